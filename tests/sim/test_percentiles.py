"""The spread of a figure over the runs of a study."""

from __future__ import annotations

from flockwire_sim.study.percentiles import spread


def test_a_spread_tells_what_each_share_of_the_runs_keeps_to() -> None:
    values = [(seed, float(seed)) for seed in range(1, 101)]
    errors, distances = spread(values, high_is_bad=True), spread(values, high_is_bad=False)
    assert errors is not None
    assert distances is not None
    assert (errors.p50, errors.p95, errors.p99, errors.worst, errors.worst_seed) == (50.0, 95.0, 99.0, 100.0, 100)
    assert (distances.p50, distances.p95, distances.p99, distances.worst_seed) == (51.0, 6.0, 2.0, 1)
    unsettled = spread([*values[:-1], (7, None)], high_is_bad=True)
    assert unsettled is not None
    assert (unsettled.p99, unsettled.worst, unsettled.worst_seed) == (99.0, None, 7)
    assert spread([(1, None)], high_is_bad=True) is None
