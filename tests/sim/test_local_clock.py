"""A process's clock: offset, drift and steps."""

from __future__ import annotations

from flockwire.domain.time import SECOND
from flockwire_sim.local_clock import LocalClock


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
