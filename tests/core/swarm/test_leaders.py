"""Leaders are a set: one without a word, none, several with tables of their own; what does not fit is refused."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from flockwire_core.loading import SwarmFileError
from flockwire_core.swarm.trajectories import leader_speed
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.processes import LEADING

THREE: dict[str, Any] = {
    "leaders": [0, 1, 9],
    "leader": {"speed": 0.7, "1": {"trajectory": {"kind": "constant", "velocity": [0.2, 0.0, 0.0]}},
               "9": {"kind": "virtual", "start": [1.0, 2.0, 1.5], "speed": 0.4}},
    "graph.edges": [[0, 2], [1, 3], [9, 4]],
}  # fmt: skip


def test_a_file_without_a_word_has_leader_0(make_swarm: Callable[..., Any]) -> None:
    swarm = make_swarm()
    assert (swarm.leaders, swarm.sole_leader, swarm.followers) == ((0,), 0, (1, 2, 3, 4))
    assert Plan(swarm).pilot[0] == "leader"


def test_each_leader_has_its_own_table_and_the_keys_of_all(make_swarm: Callable[..., Any], law_file: str) -> None:
    swarm = make_swarm(THREE | {"control.law": f"{law_file}:Still"})
    assert (swarm.followers, swarm.sole_leader, swarm.flying) == ((2, 3, 4), None, (0, 1, 2, 3, 4))
    assert [leader.speed for leader in swarm.leading.values()] == [0.7, 0.7, 0.4]
    assert [leader.kind for leader in swarm.leading.values()] == ["trajectory", "trajectory", "virtual"]
    assert swarm.leading[1].trajectory.kind == "constant"
    assert type(swarm).model_validate_json(swarm.model_dump_json()).leading == swarm.leading  # as a trace keeps it
    plan = Plan(swarm)
    assert [plan.pilot[i] for i in swarm.leaders] == ["leader", "leader1", "leader9"]
    assert len({plan.endpoints[plan.pilot[i]] for i in swarm.leaders}) == len(swarm.leaders)


def test_without_a_leader_all_follow_and_nobody_publishes_its_pose(
    make_swarm: Callable[..., Any], law_file: str
) -> None:
    swarm = make_swarm({"leaders": [], "graph.edges": [[0, 1]], "control.law": f"{law_file}:Still"})
    assert (swarm.followers, swarm.sole_leader, leader_speed(swarm)) == ((0, 1, 2, 3, 4), None, 0.0)
    plan = Plan(swarm)
    assert not plan.of(LEADING)
    assert plan.pilot[0] == "uav0"


@pytest.mark.parametrize(
    ("changes", "line"),
    [
        ({"leaders": [0, 0]}, "leaders.1 = 0: this leader appears twice"),
        ({"leaders": [0, 7]}, "drones: the leader, id 7, is missing (leader.kind = 'trajectory' has its own body)"),
        ({"leaders": [-1]}, "leaders.0 = -1: must be a whole number of 0 or more"),
        ({"leader": {"3": {}}}, "leader.3: leaders = [0] has no 3; add it, or remove the table"),
        ({"leader": {"spede": 1.0}}, "leader.spede = 1.0: unknown key; did you mean leader.speed?"),
        ({"leader": {"0": {"spede": 1.0}}}, "leader.0.spede = 1.0: unknown key; did you mean leader.0.speed?"),
        (THREE | {"graph.edges.0": [2, 9]}, "graph.edges.0 = [2, 9]: a leader has no in-neighbours"),
        (THREE | {"graph.edges": [[0, 2]]}, "graph.edges: no spanning tree from a leader: none reaches uav3, uav4"),
        ({"leaders": [], "graph.edges": [[1, 2]]}, "leaders = []: control.law = 'paper' needs 1, the file has 0"),
        (THREE, "leaders = [0, 1, 9]: control.law = 'paper' needs 1, the file has 3"),
    ],
)
def test_what_does_not_fit_is_refused(make_swarm: Callable[..., Any], changes: dict[str, Any], line: str) -> None:
    with pytest.raises(SwarmFileError) as refused:
        make_swarm(changes)
    assert line in str(refused.value)


@pytest.fixture
def law_file(tmp_path: Any) -> str:
    """Return the file of a law that takes any number of leaders."""
    file = tmp_path / "still.py"
    file.write_text(
        "from flockwire.law import Decision, Information\n\n\n"
        "class Still:\n    information = Information(leaders=(0, 9))\n\n    def __init__(self, settings): pass\n\n"
        "    def step(self, seen): return Decision()\n"
    )
    return str(file)
