"""A driver's own time, by which its limits count."""

from __future__ import annotations

from flockwire_core.domain.time import SECOND
from flockwire_tello.flight_monitor import SteadyTime

BEGAN = 1_790_000_000 * SECOND


def test_a_clock_that_is_set_back_stops_the_time_and_does_not_take_it_back() -> None:
    time = SteadyTime(BEGAN)
    shown = [time.at(BEGAN + after * SECOND) // SECOND for after in (5, 6, 2, 3, -7, -6)]
    assert shown == [5, 6, 6, 7, 7, 8]


def test_a_step_that_is_too_long_has_not_passed() -> None:
    time = SteadyTime(BEGAN, longest=SECOND)
    assert [time.at(BEGAN + after * SECOND) // SECOND for after in (1, 2, 4, 5)] == [1, 2, 2, 3]


def test_a_correction_has_not_passed() -> None:
    time = SteadyTime(BEGAN)
    time.correct(100 * SECOND)
    assert time.at(BEGAN + 101 * SECOND) == SECOND
