"""Two bodies change names in the air: both drones hover, then land where they are; nobody is met, nobody flies away."""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations
from math import dist
from typing import Any

import pytest
from flockwire_core.swarm.model import uav
from flockwire_core.wire.status import APART

AT = 6.321
FENCE = {"min": [-4.0, -4.0, -0.5], "max": [4.0, 4.0, 3.0]}
LASTING = {"at": 3.0, "kind": "swap", "drones": [1, 2], "duration": 20.0}
RESTART = {"at": 4.0, "kind": "restart", "process": "gateway"}
WIDE = {"control.rate_hz": 20, "gateway.rate_hz": 20}
SLOW = {"control.law": "extended", "control.rate_hz": 20, "gateway.rate_hz": 20, "limits.fence": FENCE}


def ways(flown: Any) -> dict[int, list[Any]]:
    """Return the true positions of each drone."""
    return {i: [pose.position for _, pose in flown.of("truth", uav(i))] for i in range(5)}


def found(flown: Any) -> set[str]:
    """Return whose pilots found that their poses are not their own."""
    pilots = ("leader", *map(uav, range(1, 5)))
    return {pilot for pilot in pilots for _, status in flown.of("status", pilot)
            if any(reason.code == APART for reason in status.report.reasons)}  # fmt: skip


@pytest.mark.parametrize(
    ("drones", "pilots"),
    [([1, 4], {"uav1", "uav4"}), pytest.param([0, 2], {"leader", "uav2"}, marks=pytest.mark.long)],
)
def test_both_hover_then_land_where_they_are(fly: Callable[..., Any], drones: list[int], pilots: set[str]) -> None:
    swap = {"at": AT, "kind": "swap", "drones": drones, "duration": 1.0}
    flown = fly({"control.law": "extended"}, swap, duration=10.0)
    assert found(flown) == pilots
    for drone, pilot in zip(drones, sorted(pilots, key=lambda one: one != "leader"), strict=True):
        assert next(t for t, phase, _ in flown.phases(pilot, AT) if phase == "hold") < AT + 0.25
        landed = next(t for t, phase, _ in flown.phases(pilot, AT) if phase == "landing")
        assert AT + 0.9 < landed < AT + 1.25
        at = min(flown.of("truth", uav(drone), AT), key=lambda row: row[0])[1].position
        assert dist(at[:2], ways(flown)[drone][-1][:2]) < 0.5
    frames: dict[int, dict[str, Any]] = {}
    for i in range(5):
        for _, pose in flown.of("truth", uav(i)):
            frames.setdefault(pose.stamp, {})[uav(i)] = pose.position
    assert min(dist(a, b) for frame in frames.values() for a, b in combinations(frame.values(), 2)) > 0.4
    said = [status.report.detail for _, status in flown.of("status", "gateway", AT)]
    assert any("poses of" in detail and all(uav(i) in detail for i in drones) for detail in said)


def test_names_that_are_exchanged_for_a_moment_change_nothing(fly: Callable[..., Any]) -> None:
    flown = fly({"control.law": "extended"}, {"at": AT, "kind": "swap", "drones": [1, 4], "duration": 0.08})
    assert (found(flown), flown.outcome.failure) == (set(), "")
    assert any(name == "poses refused" for name, _ in flown.of("status", "uav1")[-1][1].report.counts)


@pytest.mark.long
@pytest.mark.parametrize("restarted", [(), (1,), (1, 2)])
@pytest.mark.parametrize("law", ["extended", "paper"])
def test_two_that_are_exchanged_while_the_gateway_is_away_come_down_inside_the_fence(
    fly: Callable[..., Any], law: str, restarted: tuple[int, ...]
) -> None:
    exchanged = LASTING | {"at": 4.1}
    pilots = [{"at": 4.2, "kind": "restart", "process": uav(i)} for i in restarted]
    flown = fly(SLOW | {"control.law": law}, RESTART, exchanged, *pilots, duration=12.0)
    room, places = flown.world.swarm.limits.fence.room(), ways(flown)
    assert max(room.outside(place) for way in places.values() for place in way) == 0.0
    assert all(way[-1][2] <= 0.0 for way in places.values())
    assert found(flown) & {"uav1", "uav2"}  # the other one may have landed before it knew


@pytest.mark.parametrize("law", ["extended", "paper"])
def test_two_that_are_exchanged_while_the_gateway_is_frozen_fly_by_no_pose_of_another(
    fly: Callable[..., Any], law: str
) -> None:
    frozen = {"at": 4.0, "kind": "freeze", "process": "gateway", "duration": 0.6}
    flown = fly(SLOW | {"control.law": law}, frozen, LASTING | {"at": 4.2}, duration=8.0)
    assert found(flown) >= {"uav1", "uav2"}
    room = flown.world.swarm.limits.fence.room()
    assert max(room.outside(place) for way in ways(flown).values() for place in way) == 0.0


@pytest.mark.long
@pytest.mark.parametrize("law", ["extended", "paper"])
def test_nobody_is_taken_for_another_though_gateway_and_pilot_restart_in_a_gusty_wind(
    fly: Callable[..., Any], law: str
) -> None:
    wind = {"wind": {"velocity": [1.0, 0.0, 0.0], "gust": 0.5}, "airframes.kinematics.gain": 0.8}
    compensated = {"control.disturbance": 1.5} if law == "extended" else {}
    restarts = [{"at": at, "kind": "restart", "process": who} for at, who in ((4.0, "gateway"), (4.2, "uav2"))]
    flown = fly(WIDE | wind | compensated | {"control.law": law}, *restarts, duration=12.0)
    assert found(flown) == set()
    assert flown.phases("uav2", 5.0)
