"""Where a drone comes down; tests/leader/test_landing.py flies it."""

from math import dist

import pytest
from flockwire_core.control.fence import Room
from flockwire_core.control.free_place import SPARE, landing_place, meets
from flockwire_core.domain.body import Body, BodyKind, Separation

HERE, KEPT = (1.0, 0.5, 1.0), 0.4 + 0.03  # m: where it flies, and how far from a drone the safety filter stays


SEPARATION = Separation(KEPT, 0.3 + 0.03)
HALL = Room((-10.0, -10.0, -0.5), (10.0, 10.0, 3.0))


def landing(position, place, bodies):
    return landing_place(position, place, bodies, SEPARATION, HALL)


def drone(x, y, z=-1.0):
    return Body(BodyKind.DRONE, (x, y, z), 0.0)


def test_with_nothing_below_it_lands_on_its_place():
    assert landing(HERE, HERE, ()) == (HERE, True)
    assert landing(HERE, (1.2, 0.5, 1.0), (drone(-0.5, 0.0), drone(0.0, 0.9))) == ((1.2, 0.5, 1.0), True)


def test_what_is_above_is_not_in_its_way():
    assert landing(HERE, HERE, (drone(0.1, 0.0, 0.6),)) == (HERE, True)


@pytest.mark.parametrize(
    ("body", "above", "beneath"),
    [
        (drone(0.1, 0.0, 0.6), False, True),
        (drone(0.1, 0.0, -0.6), True, False),
        (drone(KEPT + 0.01, 0.0, 0.6), False, False),
        (drone(KEPT + 0.01, 0.0, -0.6), False, False),
        (Body(BodyKind.OBSTACLE, (0.0, 0.3, 0.0), 0.2), True, False),
    ],
)
def test_who_is_above_and_who_is_beneath(body, above, beneath):
    assert (meets((body,), SEPARATION, above=False), meets((body,), SEPARATION, above=True)) == (above, beneath)


def test_over_a_drone_it_takes_the_nearest_place_beside_it():
    place, free = landing(HERE, HERE, (drone(-0.1, 0.0),))
    assert place == pytest.approx((0.9 + KEPT + SPARE, 0.5, 1.0))
    assert not free


def test_beside_an_occupied_place_it_takes_its_own():
    place, free = landing(HERE, (0.2, 0.5, 1.0), (drone(-0.7, 0.0),))
    assert (place, free) == (HERE, True)


def test_an_obstacle_leaves_its_radius_and_more():
    kept = 0.2 + SEPARATION.obstacle
    place, free = landing(HERE, HERE, (Body(BodyKind.OBSTACLE, (0.0, 0.3, -0.5), 0.2),))
    assert dist(place[:2], (1.0, 0.8)) == pytest.approx(kept + SPARE)
    assert not free


def test_without_a_free_place_it_lands_straight_down():
    assert landing(HERE, HERE, (Body(BodyKind.OBSTACLE, (0.0, 0.0, -0.5), 50.0),)) == (HERE, True)


def test_a_body_farther_than_any_room_is_not_in_its_way():
    far = Body(BodyKind.OBSTACLE, (1e200, -1e200, -0.5), 1.0)
    place, free = landing(HERE, HERE, (drone(-0.1, 0.0), far))
    assert place == pytest.approx((0.9 + KEPT + SPARE, 0.5, 1.0))
    assert not free


def test_in_a_narrow_room_it_takes_a_place_without_spare():
    side = KEPT + 0.02
    room = Room((0.0, 0.0, -0.5), (side, side, 3.0))
    below = [drone(0.0, 0.0), drone(0.0, side)]
    place, free = landing_place((0.0, 0.0, 1.0), (0.0, 0.0, 1.0), below, SEPARATION, room)
    assert min(dist(place[:2], body.relative_position[:2]) for body in below) >= KEPT - 1e-9
    assert not free
