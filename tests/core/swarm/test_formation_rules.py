from itertools import combinations
from math import dist

import pytest
from flockwire_core.control.formation import Circle, grid, line
from flockwire_core.control.key_frames import KeyFrames
from flockwire_core.domain.vector import norm
from flockwire_core.swarm.formation_rules import survey
from hypothesis import given, settings
from hypothesis import strategies as st

coordinates = st.floats(-5.0, 5.0)
places = st.lists(st.tuples(coordinates, coordinates, coordinates), min_size=2, max_size=12)


def test_a_circle():
    result = survey(Circle(count=4, radius=2.0, rate=0.5), horizon=20.0, samples=400)
    assert result.max_speed == pytest.approx(1.0)
    assert result.min_distance == pytest.approx(8**0.5)
    assert result.min_distance_leader == pytest.approx(2.0)
    assert result.low == pytest.approx((-2.0, -2.0, 0.0), abs=1e-3)
    assert result.high == pytest.approx((2.0, 2.0, 0.0), abs=1e-3)


def test_a_single_follower_has_no_pair():
    result = survey(line(count=1, spacing=0.5, heading=0.0, rate=0.0), horizon=1.0, samples=1)
    assert result.min_distance == float("inf")
    assert result.min_distance_leader == 0.5


@settings(max_examples=50)
@given(places, st.data())
def test_the_sweep_finds_the_nearest_pair_of_all(starts, data):
    ends = data.draw(st.lists(st.tuples(coordinates, coordinates, coordinates), min_size=len(starts)))
    tracks = list(zip(starts, ends, strict=False))
    formation = KeyFrames(((0.0, 1.0),) * len(tracks), tuple(tracks))
    sampled = [[formation.offset(i, k / 4) for i in range(formation.count)] for k in range(5)]
    result = survey(formation, horizon=1.0, samples=5)
    assert result.min_distance == min(dist(a, b) for points in sampled for a, b in combinations(points, 2))
    assert result.min_distance_leader == min(norm(point) for points in sampled for point in points)


@pytest.mark.parametrize("heading", [0.0, 0.8, 1.5707963267948966])
def test_two_hundred_drones_in_a_line_are_swept_along_it(heading):
    result = survey(line(count=200, spacing=0.7, heading=heading, rate=0.0), horizon=10.0, samples=20)
    assert result.min_distance == pytest.approx(0.7)


def test_two_hundred_drones_in_a_turning_grid():
    result = survey(grid(count=200, spacing=1.0, columns=14, rate=0.3), horizon=10.0, samples=50)
    assert result.min_distance == pytest.approx(1.0)
    assert result.min_distance_leader == pytest.approx(1.0)
