"""What is not recorded is not known: no position is made up across a gap."""

import numpy as np
from flockwire_analysis.series import Series
from flockwire_analysis.tracking import SILENCE, interpolated
from flockwire_core.domain.time import SECOND, nanoseconds


def series(*seconds):
    stamps = np.array([nanoseconds(t) for t in seconds], np.int64)
    places = np.stack([stamps / SECOND, np.zeros(len(stamps)), np.ones(len(stamps))], axis=1)
    return Series(stamps, stamps, stamps, np.arange(len(stamps)), places)


def test_between_samples_it_is_linear_and_outside_unknown():
    found = interpolated(series(1.0, 1.1, 1.2), np.array([0.9, 1.05, 1.2, 1.3]) * SECOND)
    assert np.allclose(found[1:3, 0], [1.05, 1.2])
    assert np.isnan(found[[0, 3]]).all()


def test_across_a_gap_nothing_is_known_but_at_its_ends():
    gap = SILENCE / SECOND + 0.1
    found = interpolated(
        series(1.0, 1.1, 1.1 + gap, 1.2 + gap), np.array([1.05, 1.1, 1.3, 1.1 + gap, 1.15 + gap]) * SECOND
    )
    assert np.isfinite(found[[0, 1, 4]]).all()
    assert np.isnan(found[2]).all()
