"""The offset between two clocks, from stamps over links with delay, jitter, loss and drift."""

from __future__ import annotations

from random import Random

import pytest
from flockwire_core.control.clock_offset import DRIFT, OffsetEstimator
from flockwire_core.domain.time import SECOND, nanoseconds

MS = 1_000_000


class Clocks:
    """An own clock that is off and drifts, and links whose delays are drawn between `shortest` and `longest`."""

    def __init__(self, seed: int, shortest: float = 0.0, longest: float = 0.04, drift: float = 50e-6) -> None:
        self._chance = Random(seed)
        self._delays, self._drift = (shortest, longest), self._chance.choice((-drift, drift))
        self.offset = self._chance.uniform(-0.2, 0.2)
        self.estimator = OffsetEstimator()

    def own(self, true: float) -> int:
        """Return what the own clock shows, ns."""
        return round((true * (1.0 + self._drift) - self.offset) * SECOND)

    def exchange(self, true: float) -> float:
        """Make one round trip from the time `true` on; returns its end."""
        there = true + self._chance.uniform(*self._delays)
        back = there + self._chance.uniform(*self._delays)
        assert self.estimator.add(self.own(true), nanoseconds(there), nanoseconds(there), self.own(back))
        return back

    def errors(self, seconds: float, rate: float) -> list[tuple[float, float]]:
        """Return how wrong each estimate is and how wrong it says that it may be, ms, once a second after 10 s."""
        found = []
        for k in range(round(seconds * rate)):
            end = self.exchange(k / rate)
            if k / rate >= 10.0 and k % round(rate) == 0:
                estimate = self.estimator.estimate(self.own(end))
                assert estimate is not None
                wrong = estimate.offset - (nanoseconds(end) - self.own(end))
                found.append((abs(wrong) / MS, estimate.bound / MS))
        return found


@pytest.mark.parametrize("seed", range(10))
def test_delay_jitter_and_drift_leave_two_milliseconds(seed: int) -> None:
    errors = Clocks(seed).errors(40.0, 10.0)
    assert max(wrong for wrong, _ in errors) < 2.0
    assert all(wrong <= bound for wrong, bound in errors)


def test_a_quiet_link_is_known_to_its_round_trip() -> None:
    errors = Clocks(1, shortest=0.0005, longest=0.001).errors(30.0, 1.0)
    assert max(wrong for wrong, _ in errors) < 0.3
    assert all(wrong <= bound < 1.5 for wrong, bound in errors)


def test_unequal_delays_stay_within_the_bound() -> None:
    clocks = Clocks(2)
    for k in range(100):
        sent, arrived, returned = k * SECOND // 10, k * SECOND // 10 + 30 * MS, k * SECOND // 10 + 31 * MS
        clocks.estimator.add(sent, arrived, arrived, returned)
    estimate = clocks.estimator.estimate(10 * SECOND)
    assert estimate is not None
    assert 14 * MS < estimate.offset < 15 * MS
    assert estimate.bound > estimate.offset


def test_a_clock_that_was_set_is_followed() -> None:
    estimator = OffsetEstimator()
    for k in range(50):
        step = 0 if k < 25 else SECOND
        sent = k * SECOND // 10 + step
        estimator.add(sent, sent - step + MS, sent - step + MS, sent + 2 * MS)
        estimate = estimator.estimate(sent + 2 * MS)
    assert estimate is not None
    assert abs(estimate.offset + SECOND) < MS


def test_nothing_is_known_before_replies_and_impossible_ones_are_refused() -> None:
    estimator = OffsetEstimator()
    assert estimator.estimate(0) is None
    assert not estimator.add(0, 10, 9, 20)
    assert not estimator.add(0, 10, 31, 20)
    assert estimator.estimate(0) is None


def test_the_drift_allowed_covers_two_quartzes() -> None:
    assert DRIFT >= 2 * 50e-6
