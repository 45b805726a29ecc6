"""Two bodies change names in the air: both pilots hold, nobody collides, no pose is false."""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations
from math import dist
from typing import Any

import pytest
from flockwire.swarm.model import uav

AT = 6.321


@pytest.mark.parametrize(("drones", "pilots"), [([1, 4], ("uav1", "uav4")), ([0, 2], ("leader", "uav2"))])
def test_both_hold_and_the_others_fly_on(fly: Callable[..., Any], drones: list[int], pilots: tuple[str, ...]) -> None:
    swap = {"at": AT, "kind": "swap", "drones": drones, "duration": 1.0}
    flown = fly({"control.law": "extended"}, swap, duration=10.0)
    for drone, pilot in zip(drones, pilots, strict=True):
        told = [t for t, _ in flown.of("doubt", uav(drone))]
        assert AT < told[0] < AT + 0.03
        held = next(t for t, phase, _ in flown.phases(pilot, AT) if phase == "hold")
        assert held < AT + 0.03 + 0.1  # statuses come ten times a second
        assert told[-1] < AT + 2.1
    assert not [
        key
        for t, published, _ in flown.published
        if (key := published.key).kind == "doubt" and key.owner not in map(uav, drones)
    ]
    frames: dict[int, dict[str, Any]] = {}
    for i in range(5):
        truth = {pose.stamp: pose.position for _, pose in flown.of("truth", uav(i))}
        assert all(pose.position == truth[pose.stamp] for _, pose in flown.of("pose", uav(i)))
        for stamp, place in truth.items():
            frames.setdefault(stamp, {})[uav(i)] = place
    assert min(dist(a, b) for frame in frames.values() for a, b in combinations(frame.values(), 2)) > 0.4
    gateway = flown.of("status", "gateway")[-1][1].report
    assert ("swaps", 1) in gateway.counts
    assert gateway.latency >= 0.0


FENCE = {"min": [-4.0, -4.0, -0.5], "max": [4.0, 4.0, 3.0]}
LASTING = {"at": 3.0, "kind": "swap", "drones": [1, 2], "duration": 20.0}
RESTART = {"at": 4.0, "kind": "restart", "process": "gateway"}  # it takes the exchanged names for right
WIDE = {"control.rate_hz": 20, "gateway.rate_hz": 20}
SLOW = {"control.law": "extended", "control.rate_hz": 20, "gateway.rate_hz": 20, "limits.fence": FENCE}


def ways(flown: Any) -> dict[int, list[Any]]:
    """Return the true positions of each drone."""
    return {i: [pose.position for _, pose in flown.of("truth", uav(i))] for i in range(5)}


@pytest.mark.long
def test_two_whose_gateway_restarts_meanwhile_stay_in_doubt_and_land_where_they_are(fly: Callable[..., Any]) -> None:
    flown = fly(SLOW | {"limits.staleness.identity_land": 2.0}, LASTING, RESTART, duration=10.0)
    assert "the tracker confuses its body with another for 2.0 s" in flown.outcome.failure
    for way in ways(flown).values():
        assert way[-1][2] <= 0.0
    room = flown.world.swarm.limits.fence.room()
    assert max(room.outside(place) for way in ways(flown).values() for place in way) == 0.0
    held = {i: [place for place in ways(flown)[i] if place[2] > 0.5][-1] for i in (1, 2)}
    assert all(dist(held[i][:2], ways(flown)[i][-1][:2]) < 0.02 for i in held)  # straight down


@pytest.mark.long
@pytest.mark.parametrize("restarted", [(), (1,), (1, 2)])
@pytest.mark.parametrize("law", ["extended", "paper"])
def test_two_that_are_exchanged_while_the_gateway_is_away_come_down_inside_the_fence(
    fly: Callable[..., Any], law: str, restarted: tuple[int, ...]
) -> None:
    """Nobody told them: they flew on by each other's poses, to 1.5 m outside the fence and more."""
    exchanged = LASTING | {"at": 4.1}
    pilots = [{"at": 4.2, "kind": "restart", "process": uav(i)} for i in restarted]
    flown = fly(SLOW | {"control.law": law}, RESTART, exchanged, *pilots, duration=12.0)
    room, places = flown.world.swarm.limits.fence.room(), ways(flown)
    assert max(room.outside(place) for way in places.values() for place in way) == 0.0
    assert all(way[-1][2] <= 0.0 for way in places.values())
    why = ("the tracker confuses its body with another", "its tracked body moves")
    for i in (1, 2):
        assert any(reason.startswith(why) for _, _, reason in flown.phases(uav(i)))


@pytest.mark.parametrize("law", ["extended", "paper"])
def test_two_that_are_exchanged_while_the_gateway_is_frozen_get_no_pose_of_another(
    fly: Callable[..., Any], law: str
) -> None:
    """The next frame counted as the first: they flew by each other's poses, to 2.25 m outside the fence."""
    frozen = {"at": 4.0, "kind": "freeze", "process": "gateway", "duration": 0.6}
    flown = fly(SLOW | {"control.law": law}, frozen, LASTING | {"at": 4.2}, duration=8.0)
    for i in range(5):
        truth = {pose.stamp: pose.position for _, pose in flown.of("truth", uav(i))}
        assert all(pose.position == truth[pose.stamp] for _, pose in flown.of("pose", uav(i)))
    assert {key.owner for _, published, _ in flown.published if (key := published.key).kind == "doubt"} == {
        "uav1",
        "uav2",
    }


@pytest.mark.long
def test_two_whose_pilots_restart_with_the_gateway_come_down_inside_the_fence(fly: Callable[..., Any]) -> None:
    """Nobody knows of the exchange any more: they flew 60 m away at first, then 1 m outside the fence."""
    pilots = [{"at": 4.0, "kind": "restart", "process": uav(i)} for i in (1, 2)]
    flown = fly(SLOW, LASTING, RESTART, *pilots, duration=12.0)
    room, places = flown.world.swarm.limits.fence.room(), ways(flown)
    assert max(room.outside(place) for way in places.values() for place in way) == 0.0
    assert all(way[-1][2] <= 0.0 for way in places.values())


@pytest.mark.long
@pytest.mark.parametrize("law", ["extended", "paper"])
def test_nobody_is_taken_for_another_though_gateway_and_pilot_restart_in_a_gusty_wind(
    fly: Callable[..., Any], law: str
) -> None:
    wind = {"wind": {"velocity": [1.0, 0.0, 0.0], "gust": 0.5}, "airframes.kinematics.gain": 0.8}
    compensated = {"control.disturbance": 1.5} if law == "extended" else {}
    restarts = [{"at": at, "kind": "restart", "process": who} for at, who in ((4.0, "gateway"), (4.2, "uav2"))]
    flown = fly(WIDE | wind | compensated | {"control.law": law}, *restarts, duration=12.0)
    said = {reason for i in range(1, 5) for _, _, reason in flown.phases(uav(i))}
    assert not [reason for reason in said if "body" in reason]
    assert flown.phases("uav2", 5.0)
