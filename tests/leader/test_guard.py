"""Every clause of the leader's safety filter: with it all is well; taken out, something is not."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from math import hypot, inf
from typing import Any

import pytest
from flockwire_core.control import barrier, guard
from flockwire_core.control.around.planner import Planner
from flockwire_core.control.fence import Room
from flockwire_core.domain.vector import ZERO, Vector, add, scale
from flockwire_core.wire.phase import Phase

EAST = {"leader.trajectory.velocity": [0.6, 0.0, 0.0]}


def straight(_: Planner, error: Vector, *__: Any) -> Vector:
    """Return a correction that turns aside for nobody: only the clause is between them."""
    return scale(error, -2.0)


def alone(**taken: Any) -> Callable[..., Any]:
    """Return `keep_clear` with some of its arguments taken out."""

    def keep(separation: Any, stopping: Any, own: Any, velocity: Any, shared: bool, *rest: Any) -> Any:
        if (taken.get("drones") and shared) or (taken.get("obstacles") and not shared):
            return None
        velocity = ZERO if taken.get("velocity") else velocity
        return barrier.keep_clear(separation, stopping, own, velocity, shared, *rest)

    return keep


@dataclass(frozen=True)
class Clause:
    """A flight, what must hold in it, and how a clause is taken out of the guard's module."""

    changes: dict[str, Any]
    holds: Callable[[Any], bool]
    out: dict[str, Any]
    obstacle: tuple[float, float, float] | None = None  # where, from the leader
    drone: tuple[float, float, float] | None = None
    closes: tuple[float, float, float] = field(default=ZERO)  # the drone's velocity


CLAUSES = {
    "obstacles": Clause(
        EAST, lambda leader: leader.clearance >= 0.3, {"keep_clear": alone(obstacles=True)}, obstacle=(1.4, 0.0, 0.0)
    ),
    "other drones": Clause(
        EAST, lambda leader: leader.closest >= 0.4, {"keep_clear": alone(drones=True)}, drone=(1.4, 0.0, 0.0)
    ),
    "moving bodies": Clause(
        EAST, lambda leader: leader.closest >= 0.4, {"keep_clear": alone(velocity=True)},
        drone=(1.4, 0.0, 0.0), closes=(-0.8, 0.0, 0.0),
    ),
    "fence": Clause(
        {**EAST, "limits.fence": {"min": [-3.5, -3.5, -0.5], "max": [3.5, 3.5, 3.0]}},
        lambda leader: leader.position[0] <= 3.5, {"half_spaces": lambda *_: []},
    ),
    "floor": Clause(
        {"leader.trajectory.velocity": [0.0, 0.0, -0.1], "limits.floor": 0.5},
        lambda leader: leader.position[2] >= 0.5, {"half_spaces": lambda *_: []},
    ),
    "speed": Clause(
        {"leader.trajectory.velocity": [1.4, 0.0, 0.0], "limits.speed": 1.1},
        lambda leader: leader.fastest <= 1.1 + 1e-9,
        {"speed_and_acceleration": lambda *_: (ZERO, 9.0, None), "limit": lambda v, _: v},
    ),
}  # fmt: skip


@pytest.mark.sources  # replaces compiled functions
@pytest.mark.parametrize("name", CLAUSES)
def test_without_the_clause_it_goes_wrong(
    name: str, flying: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    clause = CLAUSES[name]
    monkeypatch.setattr(Planner, "correction", straight)
    assert clause.holds(flown(clause, flying))
    for attribute, replacement in clause.out.items():
        monkeypatch.setattr(Room if attribute == "half_spaces" else guard, attribute, replacement)
    assert not clause.holds(flown(clause, flying))


def flown(clause: Clause, flying: Callable[..., Any], **changes: Any) -> Any:
    leader = flying({**clause.changes, **changes})
    if clause.obstacle is not None:
        leader.obstacles = [(add(leader.position, clause.obstacle), 0.3)]
    if clause.drone is not None:
        leader.drones = [(add(leader.position, clause.drone), clause.closes)]
    leader.run(5.0)
    return leader


def test_under_the_papers_law_nothing_is_round_the_leader_unless_asked_for(flying: Callable[..., Any]) -> None:
    clause, paper = CLAUSES["obstacles"], {"control.law": "paper"}
    assert not clause.holds(flown(clause, flying, **paper))
    assert clause.holds(flown(clause, flying, **paper, **{"control.safety_filter": True}))


def test_it_flies_round_known_obstacles_where_nothing_is_sensed(flying: Callable[..., Any]) -> None:
    table = {"avoidance.sensing": "neighbours", "obstacles": [{"center": [2.8, 0.0, 0.0], "radius": 0.3}]}
    leader, closest = flying({**EAST, **table}, {"nearby"}), inf
    for _ in range(500):
        leader.step()
        closest = min(closest, hypot(leader.position[0] - 2.8, leader.position[1]))
    assert 0.63 <= closest < 0.7
    assert leader.position[0] > 3.4


def test_holding_it_gives_way_to_whoever_comes_and_returns(flying: Callable[..., Any]) -> None:
    leader = flying()
    leader.order("hold")
    leader.run(2.0)
    place = leader.position
    leader.drones = [(add(place, (1.4, 0.0, 0.0)), (-0.5, 0.0, 0.0))]
    leader.run(3.0)
    assert leader.phase is Phase.HOLD
    assert leader.closest >= 0.4
    assert leader.position[0] < place[0] - 0.3
    leader.drones = []
    leader.run(5.0)
    assert leader.position == pytest.approx(place, abs=0.01)
