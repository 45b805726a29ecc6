import asyncio
from itertools import accumulate
from time import monotonic_ns

from flockwire_core.domain.time import SECOND, nanoseconds
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
