"""Laws that know no safety: what the filter keeps. Distances are margins beyond what is promised, m."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import hostile
import pytest
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.status import CORNERED

AIRFRAME = {"kinematics": {"lag": 0.2, "dead_time": 0.08}}
STILL = {"trajectory": {"kind": "constant", "velocity": [0.0, 0.0, 0.0]}}
MARGIN = 0.028  # m, of the 0.03 m that the filter adds (avoidance.margin)


def swarm(starts: list[list[float]], law: str, wish: dict[str, Any], **tables: Any) -> dict[str, Any]:
    """Return a swarm whose followers fly a hostile law."""
    return {
        "name": "hostile",
        "formation": {"kind": "circle", "radius": 1.5},
        "graph": {"edges": [[0, i] for i in range(1, len(starts))]},
        "drones": [{"id": i, "start": [*start, 0.0]} for i, start in enumerate(starts)],
        "control": {"law": f"law_hostile:{law}", "parameters": wish},
        "leader": STILL,
    } | tables


def room(half: float, ceiling: float, **limits: float) -> dict[str, Any]:
    """Return limits within a fence."""
    return {"fence": {"min": [-half, -half, -0.5], "max": [half, half, ceiling]}, **limits}


def obstacles(*found: tuple[float, float, float]) -> list[dict[str, Any]]:
    """Return obstacles by place and radius."""
    return [{"center": [x, y, 0.0], "radius": radius} for x, y, radius in found]


def test_drones_that_want_one_point_beside_an_obstacle_keep_clear() -> None:
    """0.388 m between two and 0.273 m to the obstacle, as one asked for flight that its neighbour could not give."""
    starts = [[-0.599, -0.287], [-2.965, 3.476], [-2.426, 0.486], [2.64, 2.329], [-0.051, -1.56], [0.796, -2.613]]
    squeeze = swarm(
        starts, "ToOnePoint", {"point": [-0.319, 0.466, 1.048]},
        limits=room(4.0, 2.5, speed=3.0),
        obstacles=obstacles((-0.99, 2.44, 0.333), (-1.955, -0.252, 0.308), (0.36, 0.638, 0.367), (-3.117, 2.06, 0.08)),
        airframes=AIRFRAME, gateway={"noise": 0.001, "latency": 0.01},
    )  # fmt: skip
    margins = hostile.measured(squeeze, duration=9.0, seed=1).margins
    assert min(margins["drone"], margins["obstacle"]) > MARGIN - 0.01  # noise


def test_one_that_comes_into_sight_does_not_drive_another_into_an_obstacle() -> None:
    """0.299 m: it demanded 1.3 m/s of flight, and all was relaxed by as much."""
    meeting = swarm(
        [[-4.0, -4.0], [0.585, -3.0], [3.008, 3.115]], "StraightOn", {"ways": [[0.0, 1.5, 0.0], [-0.955, -1.157, 0.0]]},
        obstacles=obstacles((0.0, 0.0, 0.25)), limits=room(6.0, 2.5, speed=1.5), airframes=AIRFRAME,
        gateway={"noise": 0.0, "latency": 0.01},
    )  # fmt: skip
    assert hostile.measured(meeting, duration=6.5).margins["obstacle"] > MARGIN


def test_a_corner_of_the_fence_is_kept_at_a_small_acceleration() -> None:
    """0.10 m outside: each wall counted on the whole acceleration."""
    ways = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [-1.0, 1.0, -0.5], [1.0, 1.0, 0.5]]
    corner = swarm(
        [[0.0, 0.0], *([x, y] for x, y, _ in ways)], "StraightOn", {"ways": ways},
        limits=room(2.5, 2.5, speed=1.5, acceleration=0.3),
    )  # fmt: skip
    assert hostile.measured(corner, duration=10.0).margins["fence"] == hostile.OUTSIDE  # nobody outside


def test_a_wall_is_kept_while_a_drone_ahead_asks_for_braking() -> None:
    """0.024 m outside: it slid along the wall, and gave the wall only a share of the braking."""
    assert hostile.fly(hostile.point_of(617)).margins["fence"] == hostile.OUTSIDE  # nobody outside


def test_a_drone_without_a_way_from_a_person_reports_it(fly: Callable[..., Any]) -> None:
    person = {
        "at": 4.0, "kind": "visitor", "start": [-3.0, 1.0, 1.2], "velocity": [1.5, 0.0, 0.0], "duration": 4.0,
    }  # fmt: skip
    slow = {
        "control.law": "law_hostile:ToOnePoint", "control.parameters": {"point": [0.0, 1.0, 1.0]},
        "drones": [{"id": 0, "start": [-3.0, -3.0, 0.0]}, {"id": 1, "start": [0.0, 1.0, 0.0]}],
        "graph.edges": [[0, 1]], "limits.acceleration": 0.5,
    }  # fmt: skip
    told = [status.report for _, status in fly(slow, person).of("status", "uav1")]
    assert {reason.code for report in told for reason in report.reasons} >= {CORNERED}
    assert dict(told[-1].counts)[CORNERED] == 1
    assert not [reason for reason in told[-1].reasons if reason.code == CORNERED]
    assert all(report.phase != Phase.GROUNDED for report in told if CORNERED in [r.code for r in report.reasons])


@pytest.mark.long
@pytest.mark.parametrize("people", [False, True], ids=["alone", "among people"])
def test_drawn_flights_keep_what_is_promised(people: bool) -> None:
    for seed in range(60):
        result = hostile.fly(hostile.point_of(seed), people)
        assert result.margins
        assert not result.breached, seed
