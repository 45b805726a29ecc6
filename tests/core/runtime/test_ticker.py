import asyncio
import threading
from concurrent.futures import ThreadPoolExecutor
from itertools import accumulate
from time import monotonic_ns

import pytest
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.runtime import ticker as ticker_module
from flockwire_core.runtime.ticker import Ticker

PERIOD = 0.002
NS = nanoseconds(PERIOD)


class Ticks:
    """The first `count` ticks of a ticker; the step at each takes `step` s. All times in ns, monotonic clock."""

    def __init__(self, count, step=0.0):
        self.lateness, self.skipped, self.began, self.ended = [], [], [], []
        asyncio.run(self._run(count, step))
        self.due = list(accumulate(1 + skipped for skipped in self.skipped))  # in periods since the start

    async def _run(self, count, step):
        done = asyncio.Event()

        def tick(lateness, skipped):
            self.began.append(monotonic_ns())
            self.lateness.append(lateness)
            self.skipped.append(skipped)
            while monotonic_ns() - self.began[-1] < step * SECOND:
                pass
            self.ended.append(monotonic_ns())
            if len(self.began) == count:
                done.set()

        ticker = Ticker(PERIOD, tick)
        self.before = monotonic_ns()
        ticker.start()
        self.after = monotonic_ns()
        await asyncio.wait_for(done.wait(), 5.0)
        ticker.stop()


def test_ticks_come_at_their_rate():
    seen = Ticks(20)
    assert all(began >= seen.before + due * NS for began, due in zip(seen.began, seen.due, strict=True))


def test_no_tick_is_forgotten():
    seen = Ticks(20, 2.5 * PERIOD)
    for ended, due in zip(seen.ended, seen.due[1:], strict=False):
        assert due >= (ended - seen.after) // NS


def test_a_ticks_lateness_is_the_time_since_it_was_due():
    seen = Ticks(20, 4.5 * PERIOD)
    for lateness, began, due in zip(seen.lateness, seen.began, seen.due, strict=True):
        assert lateness <= began - (seen.before + due * NS)
    for lateness, ended, due in zip(seen.lateness[1:], seen.ended, seen.due[1:], strict=False):
        assert lateness >= ended - (seen.after + due * NS)
    assert max(seen.lateness) > NS // 4


def test_a_slow_step_is_reported_as_skipped_ticks():
    assert Ticks(2, 4.5 * PERIOD).skipped[1] >= 3


@pytest.mark.parametrize("timerfd", [ticker_module._TIMERFD, False])
def test_one_that_is_postponed_again_and_again_does_not_tick_until_it_is_not(monkeypatch, timerfd):
    monkeypatch.setattr(ticker_module, "_TIMERFD", timerfd)

    async def run():
        ticked, loop = asyncio.Event(), asyncio.get_running_loop()
        ticker = Ticker(PERIOD, lambda *_: ticked.set())
        ticker.start()
        ticker.postpone(250)
        with ThreadPoolExecutor(1) as thread:
            for _ in range(200):
                await loop.run_in_executor(thread, ticker.postpone, 250)  # half a second
                assert not ticked.is_set()
            ended = monotonic_ns()
            await loop.run_in_executor(thread, ticker.postpone, 250)
        await asyncio.wait_for(ticked.wait(), 10.0)
        ticker.stop()
        return (monotonic_ns() - ended) / NS

    assert asyncio.run(run()) > 250


@pytest.mark.skipif(not ticker_module._TIMERFD, reason="without timerfd it comes no sooner")
def test_a_shorter_postponement_after_a_longer_one_counts():
    async def run():
        held, done, lock = [], asyncio.Event(), threading.Lock()
        ticker = Ticker(PERIOD, lambda *_: (held.append(lock.locked()), done.set()), lock)
        ticker.start()
        ticker.postpone(100_000)  # more than three minutes
        ticker.postpone(1)
        await asyncio.wait_for(done.wait(), 5.0)
        ticker.stop()
        return held

    assert all(asyncio.run(run()))


def test_ticks_that_were_postponed_come_that_many_periods_later():
    async def run():
        seen, done = [], asyncio.Event()

        def tick(lateness, skipped):
            seen.append((monotonic_ns() - lateness, skipped))
            if len(seen) == 5:
                done.set()

        ticker = Ticker(PERIOD, tick)
        ticker.start()
        before = monotonic_ns()
        ticker.postpone(3)
        await asyncio.wait_for(done.wait(), 5.0)
        ticker.stop()
        return [(due - before) / NS - sum(1 + k for _, k in seen[: i + 1]) for i, (due, k) in enumerate(seen)]

    assert min(asyncio.run(run())) >= 3


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


def test_one_that_was_stopped_before_it_began_can_begin():
    async def run():
        ticked = asyncio.Event()
        ticker = Ticker(PERIOD, lambda *_: ticked.set())
        ticker.stop()
        ticker.start()
        await asyncio.wait_for(ticked.wait(), 5.0)
        ticker.stop()
        assert ticked.is_set()

    asyncio.run(run())
