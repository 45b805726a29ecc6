"""What some runs show of all."""

from __future__ import annotations

from random import Random

import pytest
from flockwire_lab.study.findings import quantiles, wilson


def test_wilsons_interval_has_the_textbooks_values() -> None:
    assert wilson(8, 10) == pytest.approx((0.4902, 0.9433), abs=1e-4)
    assert wilson(0, 10) == pytest.approx((0.0, 0.2775), abs=1e-4)
    assert wilson(1000, 1000) == pytest.approx((0.99617, 1.0), abs=1e-5)


def test_the_true_rate_lies_in_the_interval_as_often_as_promised() -> None:
    chance, held = Random(1), 0
    for _ in range(2000):
        low, high = wilson(sum(chance.random() < 0.9 for _ in range(100)), 100)
        held += low <= 0.9 <= high
    assert 0.93 < held / 2000 < 0.975


def test_a_spread_gives_what_each_share_of_the_runs_keeps_to() -> None:
    values = [(seed, float(seed)) for seed in range(1, 101)]
    errors, distances = quantiles(values, high_is_bad=True), quantiles(values, high_is_bad=False)
    assert errors is not None
    assert distances is not None
    assert (errors.p50, errors.p95, errors.p99, errors.worst, errors.worst_seed) == (50.0, 95.0, 99.0, 100.0, 100)
    assert (distances.p50, distances.p95, distances.p99, distances.worst_seed) == (51.0, 6.0, 2.0, 1)
    unsettled = quantiles([*values[:-1], (7, None)], high_is_bad=True)
    assert unsettled is not None
    assert (unsettled.p99, unsettled.worst, unsettled.worst_seed) == (99.0, None, 7)
    assert quantiles([(1, None)], high_is_bad=True) is None
