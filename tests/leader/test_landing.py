"""A drone lands beside those on the ground: in a few seconds, and clear of them."""

from collections.abc import Callable
from math import dist
from random import Random
from typing import Any

import pytest
from flockwire_core.domain.airframe import FlightState

STILL = (0.0, 0.0, 0.0)
CROWDS = 40
FENCE = {"limits.fence": {"min": [-3.5, -3.5, -0.5], "max": [3.5, 3.5, 3.0]}}


@pytest.mark.parametrize(
    ("changes", "above", "grounded"),
    [
        pytest.param({}, (3.5, 0.0), [(3.3, 0.28), (3.3, -0.28)], id="two and the fence round a hollow"),
        pytest.param({}, (3.5, 3.5), [(3.3, 3.3)], id="one in a corner of the fence"),
        pytest.param({}, (0.0, 0.0), [(0.3, 0.0), (-0.15, 0.26), (-0.15, -0.26)], id="three round a hollow"),
        pytest.param({}, (0.0, 0.0), [(0.0, 0.0)], id="straight above one"),
        pytest.param({"limits.vertical_speed": 0.2}, (0.05, 0.0), [(0.0, 0.0)], id="slowly above one"),
        pytest.param(
            {"avoidance.drone_safety_distance": 0.7, "avoidance.drone_influence_radius": 0.8},
            (0.05, 0.0),
            [(0.0, 0.0)],
            id="above one to stay far from",
        ),
    ],
)
def test_it_lands_beside_those_on_the_ground(
    flying: Callable[..., Any], changes: dict[str, Any], above: tuple[float, float], grounded: list[tuple[float, float]]
) -> None:
    leader = flying({**FENCE, **changes})
    leader.push((*above, 1.0))
    leader.order("hold")
    leader.drones = [((x, y, 0.0), STILL) for x, y in grounded]
    leader.run(0.5)
    leader.closest = 9.0
    leader.order("land")
    leader.run(4.0 + 1.0 / leader.swarm.limits.vertical_speed)
    assert leader.state is FlightState.GROUNDED
    assert leader.closest >= leader.swarm.avoidance.drone_safety_distance


def test_above_a_field_of_drones_it_lands_at_its_edge(flying: Callable[..., Any]) -> None:
    leader = flying(FENCE)
    leader.drones = [((0.5 * i, 0.5 * j, 0.0), STILL) for i in range(-2, 4) for j in range(-2, 4)]
    leader.order("land")
    leader.run(6.0)
    assert leader.state is FlightState.GROUNDED
    assert leader.closest >= 0.4


def test_one_that_comes_to_stand_below_it_moves_it_aside(flying: Callable[..., Any]) -> None:
    leader = flying(FENCE)
    leader.order("land")
    leader.run(0.3)
    x, y, _ = leader.position
    leader.drones = [((x + 0.1, y, 0.0), STILL)]
    leader.run(4.0)
    assert leader.state is FlightState.GROUNDED
    assert dist(leader.position[:2], (x + 0.1, y)) >= 0.43


@pytest.mark.parametrize("seed", range(CROWDS))
def test_in_a_corner_full_of_drones_and_obstacles_it_lands(flying: Callable[..., Any], seed: int) -> None:
    leader, draw = flying(FENCE), Random(seed)
    x, y = draw.uniform(2.5, 3.5), draw.uniform(2.5, 3.5)
    leader.push((x, y, 1.0))
    leader.order("hold")
    for _ in range(draw.randint(1, 7)):
        place = (min(x + draw.uniform(-0.7, 0.7), 3.5), min(y + draw.uniform(-0.7, 0.7), 3.5), 0.0)
        if all(dist(place, other) > 0.44 for other, _ in leader.drones):
            leader.drones.append((place, STILL))
    for _ in range(draw.randint(0, 2)):
        place, radius = (x + draw.uniform(-1.2, 1.2), y + draw.uniform(-1.2, 1.2), 0.0), draw.choice((0.0, 0.1, 0.2))
        if dist(place[:2], (x, y)) > radius + 0.45:
            leader.obstacles.append((place, radius))
    leader.run(0.5)
    leader.closest = leader.clearance = 9.0
    leader.order("land")
    leader.run(6.0)
    assert leader.state is FlightState.GROUNDED
    assert leader.closest >= 0.4
    assert leader.clearance >= 0.3
