import asyncio

from flockwire.nanoseconds import BILLION
from flockwire.runtime.ticker import Ticker

PERIOD = 0.002


def ticks(count, tick=lambda: None):
    """Return (lateness, skipped) of the first `count` ticks; `tick` is called at each."""
    seen = []

    async def run():
        done = asyncio.Event()

        def record(lateness, skipped):
            seen.append((lateness, skipped))
            tick()
            if len(seen) == count:
                done.set()

        ticker = Ticker(PERIOD, record)
        ticker.start()
        await asyncio.wait_for(done.wait(), 5.0)
        ticker.stop()

    asyncio.run(run())
    return seen


def spin(seconds):
    from time import monotonic

    until = monotonic() + seconds
    while monotonic() < until:
        pass


def test_ticks_come_at_their_rate_and_none_is_forgotten():
    from time import monotonic_ns

    began = monotonic_ns()
    seen = ticks(20)
    elapsed = monotonic_ns() - began
    due = sum(1 + skipped for _, skipped in seen)
    assert elapsed >= due * PERIOD * BILLION
    assert all(lateness >= 0 for lateness, _ in seen)


def test_a_slow_step_is_told_as_skipped_ticks():
    seen = ticks(2, lambda: spin(4.5 * PERIOD))
    assert seen[1][1] >= 3


def test_after_stop_nothing_ticks():
    async def run():
        seen = []
        ticker = Ticker(PERIOD, lambda *_: seen.append(1))
        ticker.start()
        ticker.stop()
        ticker.stop()
        done = asyncio.Event()
        asyncio.get_running_loop().call_later(5 * PERIOD, done.set)
        await done.wait()
        assert not seen

    asyncio.run(run())


def test_stopping_one_that_never_began_is_harmless():
    Ticker(PERIOD, lambda *_: None).stop()
