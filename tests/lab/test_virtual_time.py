"""Events come at their times, and at one time in the order in which they were scheduled."""

from __future__ import annotations

import random

from flockwire_core.domain.time import SECOND
from flockwire_lab.virtual_time import LocalClock, Scheduler


def test_events_come_by_time_then_in_the_order_of_scheduling() -> None:
    scheduler, seen = Scheduler(0), []
    times = [random.Random(1).randrange(20) for _ in range(500)]
    for number, time in enumerate(times):
        scheduler.at(time, lambda argument: seen.append((scheduler.now, argument)), number)
    scheduler.run(100)
    assert seen == sorted(zip(times, range(500), strict=True))


def test_events_beyond_the_end_wait() -> None:
    scheduler, seen = Scheduler(0), []
    for time in (1, 5, 9):
        scheduler.at(time, seen.append, time)
    scheduler.run(5)
    assert seen == [1, 5]
    scheduler.run(9)
    assert seen == [1, 5, 9]


def test_an_event_may_schedule_another_for_now_and_stop_the_run() -> None:
    scheduler, seen = Scheduler(0), []
    scheduler.at(3, lambda _: scheduler.at(3, seen.append, "now"))
    scheduler.at(4, lambda _: scheduler.stop())
    scheduler.at(5, seen.append, "later")
    scheduler.run(100)
    assert seen == ["now"]
    assert scheduler.now == 4


def test_offset_and_drift_add_to_the_true_time() -> None:
    clock = LocalClock(100 * SECOND, offset=7, drift=50_000)  # 50 us per s
    assert clock.read(100 * SECOND) == 100 * SECOND + 7
    assert clock.read(110 * SECOND) == 110 * SECOND + 7 + 500_000


def test_a_step_sets_it() -> None:
    clock = LocalClock(0, offset=5)
    clock.step(-25)
    assert clock.read(1000) == 980


def test_a_fast_clocks_second_is_shorter() -> None:
    assert LocalClock(0, drift=SECOND).true_length(10) == 5
    assert LocalClock(0).true_length(10_000_000) == 10_000_000
