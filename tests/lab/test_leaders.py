"""A swarm without a leader, and one with three that fly paths of their own: the law's own error judges both."""

from __future__ import annotations

from collections.abc import Callable
from itertools import groupby
from operator import attrgetter
from typing import Any

import numpy as np
import pytest
from flockwire_analysis.figures.graph import columns
from flockwire_analysis.recorded import Trace
from flockwire_analysis.summary import summarise
from flockwire_analysis.view import outline
from flockwire_core.wire.plan import Plan
from flockwire_lab.faults.file import parse_faults
from flockwire_lab.flight import Flight, fly_in_memory

BOTH = [[1, 2], [2, 1], [2, 3], [3, 2], [1, 3], [3, 1]]
HULL = [[1, 4], [2, 4], [3, 5], [4, 5], [5, 4]]
STILL, SLOW = ({"kind": "constant", "velocity": [speed, 0.0, 0.0]} for speed in (0.0, 0.05))
PATHS = {"trajectory": STILL, "3": {"trajectory": SLOW}}
STARTS = {1: [3.0, 0.0, 0.0], 2: [-3.0, 2.0, 0.0], 3: [-3.0, -2.0, 0.0], 4: [0.0, -3.0, 0.0], 5: [0.0, 4.0, 0.0]}


LED: dict[str, Any] = {
    "leaders": [1, 2, 3], "leader": PATHS, "graph.edges": HULL, "obstacles": [], "avoidance.sensing": "nearby",
    "formation": {"kind": "circle", "radius": 1.0}, "drones": [{"id": i, "start": at} for i, at in STARTS.items()],
}  # fmt: skip


@pytest.fixture
def fly_led(make_swarm: Callable[..., Any]) -> Callable[..., Trace]:
    """Fly drones with these leaders in virtual time."""

    def fly(leaders: list[int], drones: range, law: str, edges: list[list[int]], **changes: Any) -> Trace:
        swarm = make_swarm(
            {"leaders": leaders, "control.law": f"flockwire_laws.{law}", "graph.edges": edges, "obstacles": [],
             "formation": {"kind": "circle", "radius": 1.0}, "avoidance.sensing": "nearby",
             "drones": [{"id": i, "start": STARTS[i]} for i in drones], **changes}
        )  # fmt: skip
        outcome, trace = fly_in_memory(Flight(swarm, 0, 20.0), lambda _: None)
        assert not outcome.failure
        return trace

    return fly


def test_without_a_leader_all_agree_on_a_place_and_keep_its_height(fly_led: Callable[..., Trace]) -> None:
    trace = fly_led([], range(1, 4), "consensus:Consensus", BOTH)
    summary = summarise(trace)
    assert [check.name for check in summary.checks if not check.ok] == []
    assert summary.missing == ()
    tail = summary.formation_error_m.max_tail
    assert tail is not None
    assert tail < 0.01  # by the law's own measure
    assert len(columns(trace.swarm.topology)) == 3


@pytest.mark.long
def test_three_leaders_fly_their_own_paths_and_contain_the_others(fly_led: Callable[..., Trace]) -> None:
    trace = fly_led([1, 2, 3], range(1, 6), "containment:Containment", HULL, leader=PATHS)
    assert [check.name for check in summarise(trace).checks if not check.ok] == []
    tail = {i: trace.positions(i).values[-400] for i in STARTS}
    moved = {i: float(np.ptp(trace.positions(i).values[-1500:-400, 0])) for i in (1, 2, 3)}
    assert moved[3] > 0.4
    assert max(moved[1], moved[2]) < 0.05
    assert tail[4] == pytest.approx((tail[1] + tail[2] + tail[5]) / 3.0, abs=0.1)
    assert tail[5] == pytest.approx((tail[3] + tail[4]) / 2.0, abs=0.1)
    flows = {flow.key.owner: (flow.publishers, flow.subscribers) for flow in trace.plan.flows if flow.key.kind == "law"}
    assert flows["uav3"] == (("leader3",), ("uav5",))
    error = summarise(trace).formation_error_m.max_tail
    assert error is not None
    assert error < 0.002  # the followers hear their leaders' velocities: without their messages 15 mm


@pytest.mark.parametrize(
    ("law", "fault"),
    [
        ("containment:AtRest", {"kind": "kill"}),
        pytest.param("containment:Containment", {"kind": "kill"}, marks=pytest.mark.long),
        pytest.param("containment:Containment", {"kind": "freeze", "duration": 9.0}, marks=pytest.mark.long),
    ],
)
def test_one_of_three_leaders_is_lost_and_all_hold_then_land(
    make_swarm: Callable[..., Any], law: str, fault: dict[str, Any]
) -> None:
    swarm = make_swarm(LED | {"control.law": f"flockwire_laws.{law}"})
    lost = parse_faults({"faults": [{"at": 6.0, "process": "leader3", **fault}]}, Plan(swarm), "test")
    _, trace = fly_in_memory(Flight(swarm, 0, 14.0, lost), lambda _: None)
    for pilot in ("uav4", "uav5"):  # uav4 has no edge from the lost leader
        changes = (next(same) for _, same in groupby(trace.shown[pilot], key=attrgetter("phase")))
        told = [(change.stamp, change.phase) for change in changes]
        phases = [phase for _, phase in told]
        assert phases[phases.index("formation") :][:3] == ["formation", "hold", "landing"]
        held = next(stamp for stamp, phase in told[phases.index("formation") :] if phase == "hold")
        silent = swarm.limits.staleness.leader_silent
        assert (held - trace.missions[0].stamp) / 1e9 == pytest.approx(6.0 + silent, abs=0.3)
    assert "hold" not in [mission.verb for mission in trace.missions]  # nobody ordered it
    flows = {flow.key.owner: flow.subscribers for flow in trace.plan.flows if flow.key.kind == "leads"}
    assert set(flows["uav3"]) >= {"uav4", "uav5"}


def test_pages_know_who_leads(make_plan: Callable[..., Plan]) -> None:
    drones = outline(make_plan(LED | {"control.law": "flockwire_laws.containment:Containment"}))["drones"]
    assert {drone["id"]: drone["leads"] for drone in drones} == {1: True, 2: True, 3: True, 4: False, 5: False}
