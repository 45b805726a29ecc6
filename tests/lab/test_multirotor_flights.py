"""Virtual flights of multirotors: the checks pass, the tail is short, also in gusts; who falls hurts nobody else."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import pytest
from flockwire_analysis.summary import summarise
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.status import MOTORS_OFF
from flockwire_lab.faults.file import parse_faults
from flockwire_lab.flight import Flight, fly_in_memory
from flockwire_twins.multirotor.airframe import CRASHED, TURNED_OVER
from flockwire_twins.multirotor.swarm_file import MODELS

PLACES = ([0.0, 0.0, 0.0], [1.0, 1.1, 0.0], [-0.1, -0.8, 0.0], [-1.7, 0.6, 0.0], [-0.1, 0.9, 0.0])
FIVE = {
    "control": {"law": "extended", "formation_gain": 3.0},
    "formation": {"kind": "circle", "radius": 0.9, "rate": 0.2},
    "limits.speed": 1.0,
    "graph": {"edges": [[0, 1], [1, 2], [2, 3], [3, 4]]},
    "gateway": {"noise": 0.001, "latency": 0.01},
}
PAPER = {  # the paper's circle; its starts
    "formation": {"kind": "circle", "radius": 2.0, "rate": 1.0},
    "limits.speed": 3.0,
    "avoidance.sensing_radius": 3.0,
}
PAPERS_PLACES = ([0.0, 0.0, 0.0], [0.7, -2.2, 0.0], [-3.0, 2.2, 0.0], [-1.7, -1.7, 0.0], [2.9, 2.2, 0.0])
GUSTS = {"wind": {"velocity": [1.0, 0.0, 0.0], "gust": 0.5}}
KINDS = [(name, rotors) for name in MODELS for rotors in (False, True) if rotors or "fitted" in MODELS[name]]
IDENTIFIED = {"quad_1kg": {"lag": 0.14, "dead_time": 0.16}}  # what is far from the row's figures


def five(model: str = "cf2x_L250", rotors: bool = False, kinds: tuple[str, ...] = ("multirotor",) * 5) -> dict:
    """Return the changes that make five drones of `kinds`."""
    table = {"model": model, "rotors": rotors, **IDENTIFIED.get(model, {})}
    drones = [{"id": i, "airframe": kind, "start": PLACES[i]} for i, kind in enumerate(kinds)]
    return FIVE | {"airframes.multirotor": table, "drones": drones}


def tail(flown: Any, begin: float, owners: range = range(1, 5)) -> float:
    """Return the largest formation error that followers report from `begin` on, in the formation, m."""
    reports = [m.report for i in owners for _, m in flown.of("status", f"uav{i}", begin)]
    found = [report.formation_error for report in reports if report.phase == "formation"]
    assert len(found) > 20
    return max(found)


@pytest.mark.parametrize(
    ("model", "rotors"),
    [KINDS[0], *(pytest.param(*kind, marks=pytest.mark.long) for kind in KINDS[1:])],
)
def test_five_of_each_model_fly_in_formation_and_are_seen_to_tilt(
    fly: Callable[..., Any], model: str, rotors: bool
) -> None:
    flown = fly(five(model, rotors), duration=14.5)
    assert flown.outcome.failure == ""
    assert tail(flown, 12.0) <= 0.015
    for kind in ("pose", "truth"):
        tilts = [abs(pose.orientation[0]) + abs(pose.orientation[1]) for _, pose in flown.of(kind, "uav3")]
        assert 0.02 < max(tilts) < 0.4, kind


@pytest.mark.long
@pytest.mark.parametrize(("model", "rotors"), KINDS)
def test_the_papers_circle_is_flown_by_the_extended_law(fly: Callable[..., Any], model: str, rotors: bool) -> None:
    changes = five(model, rotors) | PAPER
    drones = [drone | {"start": start} for drone, start in zip(changes["drones"], PAPERS_PLACES, strict=True)]
    flown = fly(changes | {"drones": drones}, duration=20.0)
    assert flown.outcome.failure == ""
    assert tail(flown, 15.0) <= 0.015


@pytest.mark.long
@pytest.mark.parametrize(("model", "rotors"), [("cf2x_L250", False), ("cf21B_500", True), ("quad_1kg", True)])
def test_in_gusts_they_keep_their_places(fly: Callable[..., Any], model: str, rotors: bool) -> None:
    flown = fly(five(model, rotors) | GUSTS, duration=16.0)
    assert flown.outcome.failure == ""
    assert tail(flown, 12.0) <= 0.04


@pytest.mark.long
def test_three_kinds_of_airframes_fly_in_one_formation(fly: Callable[..., Any]) -> None:
    flown = fly(five(kinds=("kinematics", "multirotor", "tello", "multirotor", "kinematics")), duration=16.0)
    assert flown.outcome.failure == ""
    assert tail(flown, 12.0) <= 0.05


@pytest.mark.parametrize(
    ("model", "reason"),
    [("cf2x_L250", TURNED_OVER), pytest.param("quad_1kg", CRASHED, marks=pytest.mark.long)],
)
def test_with_a_lost_rotor_one_falls_and_the_others_land_unhurt(
    make_plan: Callable[..., Plan], model: str, reason: str
) -> None:
    fault = {"at": 5.0, "kind": "wear", "drone": 3, "rotors": [1.0, 0.0, 1.0, 1.0]}
    plan = make_plan(five(model, rotors=True))
    faults = parse_faults({"faults": [fault]}, plan, "test")
    _, trace = fly_in_memory(Flight(plan.swarm, 0, 10.0, faults), lambda _: None)
    assert trace.reasons[MOTORS_OFF] == (f"kinematics: uav3 {reason}",)
    (lost,) = (check for check in summarise(trace).checks if check.name == "lost drones")
    assert re.search(rf"the motors of uav3 stopped without an order at t = \S+ s: it {reason}", lost.sentence())
    assert trace.positions(3).values[-1, 2] == pytest.approx(0.0, abs=0.01)


@pytest.mark.long
@pytest.mark.parametrize("fault", [{"mass": 1.15}, {"gains": 0.7}, {"rotors": [1.0, 0.9, 1.0, 1.0]}])
def test_what_is_wrong_with_one_from_a_moment_on_is_compensated(fly: Callable[..., Any], fault: dict) -> None:
    flown = fly(five(rotors=True), {"at": 7.0, "kind": "wear", "drone": 2, **fault}, duration=16.0)
    assert flown.outcome.failure == ""
    assert tail(flown, 13.0) <= 0.05


@pytest.mark.long
def test_the_same_seed_gives_the_same_bytes(fly: Callable[..., Any]) -> None:
    a, b = (fly(five(rotors=True) | GUSTS, seed=3, duration=2.5) for _ in range(2))
    assert [m for _, _, m in a.published] == [m for _, _, m in b.published]
