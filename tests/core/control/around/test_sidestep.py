from __future__ import annotations

from math import cos, hypot, pi, sin

import pytest
from flockwire_core.control.around.sidestep import Sidestep, SidestepParameters, sidestep
from flockwire_core.domain.body import Body, BodyKind, Separation
from flockwire_core.domain.vector import Vector
from hypothesis import given
from hypothesis import strategies as st

PARAMETERS = SidestepParameters(Separation(0.4, 0.3), 0.6)
AHEAD = Body(BodyKind.DRONE, (0.4, 0.0, 0.0), 0.0)  # where nobody may be nearer


def test_both_turn_right() -> None:
    assert sidestep((1.0, 0.0, 0.2), [AHEAD], PARAMETERS, 1.0) == pytest.approx((0.0, -1.0, 0.2))
    assert sidestep((1.0, 0.0, 0.0), [AHEAD], PARAMETERS, -1.0) == pytest.approx((0.0, 1.0, 0.0))


@pytest.mark.parametrize("place", [None, (-0.4, 0.0, 0.0), (1.1, 0.0, 0.0)], ids=["nothing", "behind", "far"])
def test_nothing_in_the_way_turns_no_drone(place: Vector | None) -> None:
    wanted = (1.0, 0.0, 0.0)
    bodies = [] if place is None else [Body(BodyKind.DRONE, place, 0.0)]
    assert sidestep(wanted, bodies, PARAMETERS, 1.0) == wanted


@pytest.mark.parametrize(("kind", "least"), [(BodyKind.DRONE, 0.4), (BodyKind.OBSTACLE, 0.3), (BodyKind.MOVER, 0.3)])
@pytest.mark.parametrize("radius", [0.0, 0.2])
def test_the_gap_begins_beyond_the_distance_to_keep_from_the_surface(
    kind: BodyKind, least: float, radius: float
) -> None:
    wanted, edge = (1.0, 0.0, 0.0), radius + least + 0.6
    assert sidestep(wanted, [Body(kind, (edge + 0.001, 0.0, 0.0), radius)], PARAMETERS, 1.0) == wanted
    assert sidestep(wanted, [Body(kind, (edge - 0.001, 0.0, 0.0), radius)], PARAMETERS, 1.0) != wanted


def test_a_drone_that_flies_ahead_as_fast_blocks_nobody() -> None:
    wanted, ahead = (1.0, 0.0, 0.0), AHEAD._replace(velocity=(1.0, 0.0, 0.0))
    assert sidestep(wanted, [ahead], PARAMETERS, 1.0) == wanted
    assert sidestep(wanted, [ahead], PARAMETERS, 1.0, (1.0, 0.0, 0.0)) == pytest.approx((0.0, -1.0, 0.0))
    slower = ahead._replace(velocity=(0.5, 0.0, 0.0))
    assert sidestep(wanted, [slower], PARAMETERS, 1.0) == pytest.approx((cos(pi / 4), -sin(pi / 4), 0.0))
    assert sidestep(wanted, [ahead._replace(kind=BodyKind.OBSTACLE)], PARAMETERS, 1.0) != wanted  # a known one stands


@given(st.floats(0.0, 2 * pi), st.floats(0.2, 1.4))
def test_turning_keeps_the_speed(angle: float, away: float) -> None:
    body = Body(BodyKind.DRONE, (-away * cos(angle), -away * sin(angle), 0.0), 0.0)
    turned = sidestep((1.0, 0.5, 0.0), [body], PARAMETERS, 1.0)
    assert hypot(*turned) == pytest.approx(hypot(1.0, 0.5))


def test_a_drone_without_progress_tries_the_other_side() -> None:
    drone, sides = Sidestep(PARAMETERS, 3.0), []
    for k in range(80):
        drone.turned((1.0, 0.0, 0.0), [AHEAD], 2.0, 0.1 * k)
        sides.append(drone.side)
    assert sides[0] == 1.0
    assert sides[40] == -1.0
    assert sides[75] == 1.0
    drone.turned((1.0, 0.0, 0.0), [AHEAD], 2.0, 11.2)
    assert drone.side == -1.0
    drone.turned((1.0, 0.0, 0.0), [], 2.0, 11.3)
    assert drone.side == 1.0


def test_a_drone_with_progress_keeps_its_side() -> None:
    drone = Sidestep(PARAMETERS, 3.0)
    drone.turned((1.0, 0.0, 0.0), [], 20.0, 0.0)
    for k in range(100):
        drone.turned((1.0, 0.0, 0.0), [AHEAD], 20.0 - 0.05 * k, 0.1 * k)
        assert drone.side == 1.0
