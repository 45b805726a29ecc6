"""Every clause of the safety filter: with it nobody comes too close; taken out, somebody does."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from math import inf
from typing import Any

import pytest
from flockwire_core.control import barrier, guard
from flockwire_core.control.around.planner import Planner
from flockwire_core.control.barrier import sight_speed
from flockwire_core.control.fence import Room
from flockwire_core.control.safety_filter import nearest_velocity
from flockwire_core.domain.vector import ZERO, Vector, limit, scale
from flockwire_core.parameters import PilotParameters, pilot_parameters
from flockwire_core.swarm.model import Swarm

FAR = [0.0, 9.0]
FACE_TO_FACE = ([FAR, [-1.5, 0.0], [1.5, 0.0]], {1: [1.5, -9.0, 0.0], 2: [-1.5, -9.0, 0.0]})
TELLO = {"airframes.kinematics": {"lag": 0.25, "dead_time": 0.1}}


def straight(_: Planner, error: Vector, *__: Any) -> Vector:
    """Return a correction that turns aside for nobody: only the clause is between them."""
    return limit(scale(error, -3.0), 3.0)


def alone(**taken: Any) -> Callable[..., Any]:
    """Return `keep_clear` with some of its arguments taken out."""

    def keep(separation: Any, stopping: Any, own: Any, velocity: Any, shared: bool, *rest: Any) -> Any:
        if (taken.get("drones") and shared) or (taken.get("obstacles") and not shared):
            return None
        stopping = separation if taken.get("stopping") else stopping
        velocity = ZERO if taken.get("velocity") else velocity
        return barrier.keep_clear(separation, stopping, own, velocity, shared, *rest)

    return keep


def zero_where_impossible(*problem: Any) -> Any:
    v, violation = nearest_velocity(*problem)
    return (ZERO if violation else v), 0.0


@dataclass(frozen=True)
class Clause:
    """A flight, what must hold in it, and how a clause is taken out."""

    starts: list[list[float]]
    offsets: dict[int, list[float]]
    changes: dict[str, Any]
    holds: Callable[[Any], bool]
    out: dict[str, Any] = field(default_factory=dict)  # names in the guard's module
    without: dict[str, Any] = field(default_factory=dict)  # changes of the swarm file
    duration: float = 6.0
    stubborn_leader: bool = False  # without a safety filter of its own: it gives way to nobody


def apart(flown: Any) -> bool:
    return flown.closest >= 0.4


def clear(flown: Any) -> bool:
    return flown.obstacle >= 0.3


LEADER_COMES = {"leader.trajectory": {"kind": "constant", "velocity": [0.6, 0.0, 0.0]}}
AGAINST_THE_LEADER = ([[-2.5, 0.0], [0.0, 0.0]], {1: [-1.0, 0.0, 0.0]})
AN_OBSTACLE = {"obstacles": [{"center": [0.0, 0.0, 0.0]}]}
INTO_IT = ([FAR, [-1.5, 0.0]], {1: [1.5, -9.0, 0.0]})

CLAUSES = {
    "other drones": Clause(*FACE_TO_FACE, {}, apart, {"keep_clear": alone(drones=True)}),
    "obstacles": Clause(
        *INTO_IT, AN_OBSTACLE, clear, {"keep_clear": alone(obstacles=True)},
    ),
    "stopping points": Clause(*INTO_IT, {**AN_OBSTACLE, **TELLO}, clear, {"keep_clear": alone(stopping=True)}),
    "moving bodies": Clause(
        *AGAINST_THE_LEADER, LEADER_COMES, apart, {"keep_clear": alone(velocity=True)}, stubborn_leader=True,
    ),
    "braking": Clause(
        *FACE_TO_FACE, {"limits.acceleration": 1.5}, apart,
        {"keep_clear": lambda *a: barrier.keep_clear(*a[:6], unbraked(a[6]), *a[7:])},
    ),
    "least violation": Clause(
        *AGAINST_THE_LEADER, {**LEADER_COMES, "limits.acceleration": 2.0, "avoidance.sensing_radius": 1.3}, apart,
        {"nearest_velocity": zero_where_impossible}, stubborn_leader=True,
    ),
    "margin": Clause(
        [FAR, [-1.5, 0.0]], {1: [0.0, -9.0, 0.0]}, {**AN_OBSTACLE, "gateway.noise": 0.01}, clear,
        without={"avoidance.margin": 0.0},
    ),
    "no faster than it sees": Clause(
        *FACE_TO_FACE, {**TELLO}, apart, {"sight_speed": lambda *_: inf}
    ),
    "no faster than it learns of it": Clause(
        *FACE_TO_FACE, {"sim.delay": 0.03}, apart,
        {"sight_speed": lambda sight, r, _, b, __: sight_speed(sight, r, 0.03, b, 0.03)},
    ),
    "fence": Clause(
        [[1.5, 0.0], [0.0, 0.0]], {1: [1.9, 0.0, 0.0]},
        {"limits.fence": {"min": [-2.0, -2.0, -0.5], "max": [2.0, 2.0, 3.0]}},
        lambda flown: flown.outside <= 0.0, {"half_spaces": lambda *_: []},
    ),
    "floor": Clause(
        [FAR, [0.0, 0.0]], {1: [0.0, -9.0, -1.2]}, {},
        lambda flown: flown.lowest >= 0.1, {"half_spaces": lambda *_: []},
    ),
    "speed": Clause(
        [FAR, [-1.5, 0.0]], {1: [1.5, -9.0, 0.0]},
        {"limits.speed": 1.0, "leader.trajectory": {"kind": "constant", "velocity": [0.3, 0.0, 0.0]}},
        lambda flown: flown.fastest <= 1.0 + 1e-6,
        {"speed_and_acceleration": lambda *_: (ZERO, 9.0, None), "limit": lambda v, _: v},
    ),
}  # fmt: skip


def unbraked(approach: barrier.Approach) -> barrier.Approach:
    return barrier.Approach(approach.last, approach.speed, approach.rate, inf)


def unguarded(swarm: Swarm, number: int) -> PilotParameters:
    return pilot_parameters(swarm, number)._replace(filtered=False)


@pytest.mark.long
@pytest.mark.sources  # replaces compiled functions
@pytest.mark.parametrize("name", CLAUSES)
def test_without_the_clause_it_goes_wrong(
    name: str, fly_flock: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    clause = CLAUSES[name]
    monkeypatch.setattr(Planner, "correction", straight)
    if clause.stubborn_leader:
        monkeypatch.setattr("flockwire_leader.core.pilot_parameters", unguarded)
    flown = fly_flock(clause.starts, clause.offsets, clause.changes, clause.duration)
    assert clause.holds(flown), flown
    for attribute, replacement in clause.out.items():
        monkeypatch.setattr(Room if attribute == "half_spaces" else guard, attribute, replacement)
    flown = fly_flock(clause.starts, clause.offsets, {**clause.changes, **clause.without}, clause.duration)
    assert not clause.holds(flown), flown
