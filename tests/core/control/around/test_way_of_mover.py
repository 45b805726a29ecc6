"""The way of a mover: who is in it leaves it to the side where it is, and does not flee before the mover."""

from __future__ import annotations

from math import cos, hypot, pi, sin

import pytest
from flockwire_core.control.around.bent_place import DetourParameters
from flockwire_core.control.around.way_of_mover import EDGE, WayOfMover
from flockwire_core.control.fence import Room
from flockwire_core.domain.body import Body, BodyKind, Separation
from flockwire_core.domain.vector import ZERO, Vector
from hypothesis import given
from hypothesis import strategies as st

PARAMETERS = DetourParameters(Separation(0.43, 0.33), Room((-20.0, -20.0, 0.0), (20.0, 20.0, 3.0)), 1.5, 10.0, 0.5)
KEPT = 0.4 + 0.33 + 0.05
FASTEST = 0.8 * (1.5**2 - 1.0) ** 0.5


def person(behind: float, aside: float) -> Body:
    """Return a person at 1 m/s along X, `behind` m before the drone, which is `aside` m left of its way."""
    return Body(BodyKind.MOVER, (-behind, -aside, 0.0), 0.4, (1.0, 0.0, 0.0))


@pytest.mark.parametrize("aside", [-0.5, -0.2, 0.2, 0.5])
def test_it_leaves_to_the_side_where_it_is(aside: float) -> None:
    fled = WayOfMover(PARAMETERS).left((1.0, 0.0, 0.1), (1.0, aside, 0.0), [person(0.8, aside)])
    assert fled == pytest.approx((1.0, 0.8 * (1.5**2 - 1.0) ** 0.5 * aside / abs(aside), 0.1))


@pytest.mark.parametrize("place", [-1.0, 1.0])
def test_in_the_middle_its_place_decides_and_the_side_stays(place: float) -> None:
    way = WayOfMover(PARAMETERS)
    sides = [way.left(ZERO, (1.0, -place, 0.0), [person(0.8, aside)])[1] for aside in (0.0, 0.05, -0.05, 0.0)]
    assert all(side * place > 0.0 for side in sides)
    assert way.left(ZERO, (1.0, -place, 0.0), [person(0.8, -0.3 * place)])[1] * place < 0.0  # pushed across it


STANDING = Body(BodyKind.MOVER, (-0.8, -0.2, 0.0), 0.4, ZERO)
YIELDING = Body(BodyKind.DRONE, (-0.8, -0.2, 0.0), 0.4, (1.0, 0.0, 0.0))
BEYOND = [person(0.8, KEPT + EDGE), person(-0.1, 0.2), person(KEPT + 1.2, 0.2), STANDING, YIELDING]


@pytest.mark.parametrize("body", BEYOND)
def test_outside_the_way_and_beside_what_stands_or_yields_nothing_changes(body: Body) -> None:
    wanted = (0.3, -0.2, 0.1)
    assert WayOfMover(PARAMETERS).left(wanted, (1.0, 0.0, 0.0), [body]) == wanted


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_beside_the_way_it_flies_in_no_faster_than_it_can_stop(side: float) -> None:
    """Its place is behind the mover, on the other side of its way."""
    wanted = (-0.5, -1.2 * side, 0.0)
    limited = WayOfMover(PARAMETERS).left(wanted, (2.0, 1.6 * side, 0.0), [person(0.8, side * (KEPT + 0.05))])
    assert limited == pytest.approx((-0.5, -0.25 * FASTEST * side, 0.0))


@pytest.mark.parametrize(("aside", "leaves"), [(0.1, True), (0.7, False)])
def test_the_farther_its_way_out_the_earlier_it_leaves(aside: float, leaves: bool) -> None:
    found = WayOfMover(PARAMETERS).left(ZERO, (1.0, 0.0, 0.0), [person(KEPT + 0.5 + 0.6, aside)])
    assert (found != ZERO) is leaves


def test_what_it_will_have_flown_when_it_stops_counts() -> None:
    leaving, left = WayOfMover(PARAMETERS), WayOfMover(PARAMETERS)
    body = person(0.8, KEPT - 0.1)
    assert leaving.left(ZERO, ZERO, [body])[1] == pytest.approx(0.5 * FASTEST)
    assert left.left(ZERO, ZERO, [body], (0.0, 0.1, 0.0))[1] == pytest.approx(0.0, abs=1e-9)


def test_it_passes_behind_a_person_to_a_place_on_the_other_side() -> None:
    """It neither crosses in front nor flies along with the person."""
    way, x, y, nearest, place = WayOfMover(PARAMETERS), 0.6, -KEPT, 9.0, (-1.0, 0.8)
    for step in range(300):
        px, dx, dy = 0.01 * step, place[0] - x, place[1] - y
        gap = max(hypot(dx, dy), 1.0)
        vx, vy, _ = way.left((dx / gap, dy / gap, 0.0), (-dx, -dy, 0.0), [person(x - px, y)])
        x, y = x + 0.01 * vx, y + 0.01 * vy
        nearest = min(nearest, hypot(x - px, y))
    assert nearest > 0.65  # without the safety filter
    assert (x, y) == pytest.approx(place, abs=0.3)


def test_who_leaves_fast_enough_is_left_alone() -> None:
    wanted = (0.0, 1.2, 0.0)
    assert WayOfMover(PARAMETERS).left(wanted, ZERO, [person(0.8, 0.2)]) == wanted


@given(st.floats(0.0, 2 * pi), st.floats(0.05, 1.0), st.floats(-0.7, 0.7), st.floats(-1.0, 1.0))
def test_it_depends_on_no_direction_of_the_axes(angle: float, behind: float, aside: float, along: float) -> None:
    def turned(v: Vector) -> Vector:
        c, s = cos(angle), sin(angle)
        return (c * v[0] - s * v[1], s * v[0] + c * v[1], v[2])

    body, wanted, error = person(behind, aside), (along, 0.1, 0.0), (1.0, -0.3, 0.0)
    found = WayOfMover(PARAMETERS).left(wanted, error, [body])
    rotated = Body(body.kind, turned(body.relative_position), body.radius, turned(body.velocity))
    assert WayOfMover(PARAMETERS).left(turned(wanted), turned(error), [rotated]) == pytest.approx(turned(found))


def test_a_drone_before_a_person_gets_out_of_the_way_in_time() -> None:
    way, x, y, nearest = WayOfMover(PARAMETERS), 1.2, 0.02, 9.0
    for step in range(300):
        px = 0.01 * step
        vx, vy, _ = way.left((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), [person(x - px, y)])
        x, y = x + 0.01 * vx, y + 0.01 * vy
        nearest = min(nearest, hypot(x - px, y))
    assert nearest > 0.5
    assert y == pytest.approx(KEPT, abs=0.05)
