"""Where a drone comes down; tests/leader/test_leader_landing.py flies it."""

from math import dist

import pytest
from flockwire.flight.landing import SPARE, Landing
from flockwire.wire.messages import Body, BodyKind

HERE, KEPT = (1.0, 0.5, 1.0), 0.4 + 0.03  # m: where it flies, and how far from a drone the safety filter stays


@pytest.fixture
def landing(make_swarm):
    return Landing(make_swarm({"control.law": "extended"}))


def drone(x, y, z=-1.0):
    return Body(BodyKind.DRONE, (x, y, z), 0.0)


def test_with_nothing_below_it_comes_down_on_its_place(landing):
    assert landing.place(HERE, HERE, ()) == (HERE, True)
    assert landing.place(HERE, (1.2, 0.5, 1.0), (drone(-0.5, 0.0), drone(0.0, 0.9))) == ((1.2, 0.5, 1.0), True)


def test_what_is_above_is_not_in_its_way(landing):
    assert landing.place(HERE, HERE, (drone(0.1, 0.0, 0.6),)) == (HERE, True)


def test_over_a_drone_it_takes_the_nearest_place_beside_it(landing):
    place, free = landing.place(HERE, HERE, (drone(-0.1, 0.0),))
    assert place == pytest.approx((0.9 + KEPT + SPARE, 0.5, 1.0))
    assert not free


def test_beside_an_occupied_place_it_takes_its_own(landing):
    place, free = landing.place(HERE, (0.2, 0.5, 1.0), (drone(-0.7, 0.0),))
    assert (place, free) == (HERE, True)


def test_an_obstacle_leaves_its_radius_and_more(landing, make_swarm):
    kept = 0.2 + make_swarm().avoidance.obstacle_safety_distance + 0.03
    place, free = landing.place(HERE, HERE, (Body(BodyKind.OBSTACLE, (0.0, 0.3, -0.5), 0.2),))
    assert dist(place[:2], (1.0, 0.8)) == pytest.approx(kept + SPARE)
    assert not free


def test_where_no_place_is_free_it_comes_down_straight(landing):
    assert landing.place(HERE, HERE, (Body(BodyKind.OBSTACLE, (0.0, 0.0, -0.5), 50.0),)) == (HERE, True)
