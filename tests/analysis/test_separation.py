"""Which drone is nearest to which, of pairs that are equally far apart and of drones that are not seen."""

from types import SimpleNamespace

import numpy as np
import pytest
from flockwire_analysis.separation import nearest_drones, nearest_to, pair_distances
from flockwire_analysis.series import Series
from flockwire_core.domain.time import SECOND

TIMES = np.array([1, 2], np.int64) * SECOND // 20


def trace(**places):
    """Return a trace of drones that stand at x, m; None: not seen."""

    def positions(number):
        x = places[f"uav{number}"]
        stamps = np.array([] if x is None else TIMES, np.int64)
        return Series(stamps, stamps, stamps, stamps, np.full((len(stamps), 3), [x or 0.0, 0.0, 1.0]))

    return SimpleNamespace(flying=tuple(int(name[3:]) for name in places), positions=positions)


def test_of_pairs_that_are_equally_far_apart_the_two_of_one_pair_are_named():
    flown = trace(uav1=-1.0, uav2=1.0, uav3=-1.5, uav4=1.5)
    assert [nearest_to(flown, number, int(TIMES[0])) for number in (1, 2, 3, 4)] == [3, 4, 1, 2]


def test_each_drone_has_its_distance_to_the_nearest_that_is_seen():
    flown = trace(uav0=None, uav1=0.0, uav2=1.0, uav3=3.0)
    assert len(list(pair_distances(flown, TIMES))) == 6
    nearest = nearest_drones(flown, TIMES)
    assert np.isnan(nearest[0]).all()
    assert [nearest[number].tolist() for number in (1, 2, 3)] == [[1.0, 1.0], [1.0, 1.0], [2.0, 2.0]]


def test_who_is_alone_has_no_distance():
    assert np.isnan(nearest_drones(trace(uav1=0.0), TIMES)[1]).all()
    with pytest.raises(ValueError, match="empty"):
        nearest_to(trace(uav1=0.0, uav2=None), 1, int(TIMES[0]))
