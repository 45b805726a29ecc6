"""The extended law on clocks and a network as bad as they come: five drones whose ways cross, past an obstacle."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations, pairwise
from math import dist, hypot
from random import Random
from typing import Any

import pytest
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import Vector, add
from flockwire_core.swarm.model import Swarm
from flockwire_lab.study.file import Starts
from flockwire_lab.study.variation import random_starts

Fly = Callable[..., Any]

# Starts from which two drones meet head on; the first places of the formation lead past the obstacle.
STARTS = ((0.0, 0.0), (-0.58, 0.82), (2.82, -2.77), (1.07, 2.87), (-1.3, -2.36))
SWARM = {
    "control.law": "extended",
    "drones": [{"id": i, "start": [x, y, 0.0]} for i, (x, y) in enumerate(STARTS)],
    "obstacles": [{"center": [-1.4, -1.4, 0.0], "radius": 0.1}],
}
# Two hops of up to 40 ms, and clocks that are up to 60 ms apart: a pose may seem 140 ms old, and is good all the same.
PATIENT = {"limits.staleness.pose_zero": 0.25, "limits.staleness.nearby_slow": 0.25}
OFFSET, DRIFT = {"sim.clock_offset": 0.03}, {"sim.clock_drift": 1e-4}
DELAY, JITTER = {"sim.delay": 0.02}, {"sim.delay": 0.02, "sim.jitter": 0.02}
LOSS, REORDERING = {"sim.loss": 0.05}, {"sim.reordering": 0.02}
ALL = OFFSET | DRIFT | JITTER | LOSS | REORDERING
# Of 150 flights under ALL from random starts, two came up to 34 mm too close with the default sight and margin: clocks
# behind the cameras' make what is seen look fresher than it is. With these none did.
CAREFUL = {"avoidance.sensing_radius": 2.0, "avoidance.margin": 0.06}


@dataclass(frozen=True)
class Kept:
    """What was true in the formation phase: m, m/s."""

    closest: float  # two drones
    clearance: float  # of a follower from the obstacle's surface
    fastest: float  # follower
    error: float  # largest formation error of the last 2 s, by true time


def kept(flown: Any) -> Kept:
    swarm: Swarm = flown.world.swarm
    orders = {order.verb: order for _, order in flown.of("mission", "")}
    begin, end = orders["start"].start, orders["land"].stamp
    frames: dict[int, dict[str, Pose]] = {}
    for _, published, message in flown.published:
        if published.key.kind == "truth" and begin <= published.at <= end:
            frames.setdefault(published.at, {})[published.key.owner] = message
    followers = [f"uav{i}" for i in swarm.followers]
    (obstacle,) = swarm.obstacles
    x, y, _ = obstacle.center
    places = [[pose.position for pose in frame.values()] for frame in frames.values()]
    own = [frame[owner].position for frame in frames.values() for owner in followers]
    return Kept(
        min(dist(a, b) for frame in places for a, b in combinations(frame, 2)),
        min(hypot(p[0] - x, p[1] - y) for p in own) - obstacle.radius,
        max(speed(a[owner], b[owner]) for a, b in pairwise(frames.values()) for owner in followers),
        max(error(swarm, frame, at - begin) for at, frame in frames.items() if at > end - 2 * SECOND),
    )


def speed(a: Pose, b: Pose) -> float:
    return dist(a.position, b.position) * SECOND / (b.stamp - a.stamp)


def error(swarm: Swarm, frame: dict[str, Pose], since_start: int) -> float:
    formation, leader = swarm.build_formation(), frame["uav0"].position

    def goal(index: int) -> Vector:
        return add(leader, formation.offset(index, since_start / SECOND))

    return max(dist(frame[f"uav{i}"].position, goal(index)) for index, i in enumerate(swarm.followers))


def assert_safe(flown: Any) -> Kept:
    swarm, found = flown.world.swarm, kept(flown)
    assert found.closest >= swarm.avoidance.drone_safety_distance, found
    assert found.clearance >= swarm.avoidance.obstacle_safety_distance, found
    assert found.fastest <= swarm.limits.speed * (1.0 + 1e-9), found
    return found


@pytest.mark.parametrize(
    ("conditions", "bound"),
    [
        pytest.param(OFFSET, 0.035, id="clock offset", marks=pytest.mark.long),  # 30 ms at 1.1 m/s
        pytest.param(DRIFT, 0.003, id="clock drift", marks=pytest.mark.long),
        pytest.param(DELAY, 0.005, id="delay", marks=pytest.mark.long),
        pytest.param(JITTER, 0.010, id="jitter", marks=pytest.mark.long),
        pytest.param(LOSS, 0.003, id="loss", marks=pytest.mark.long),
        pytest.param(REORDERING, 0.003, id="reordering", marks=pytest.mark.long),
        pytest.param(ALL, 0.040, id="all"),
    ],
)
def test_no_drone_comes_too_close_and_the_formation_is_kept(
    conditions: dict[str, float], bound: float, fly: Fly
) -> None:
    flown = fly(SWARM | PATIENT | conditions, seed=148, duration=9.0)
    assert flown.outcome.failure == ""
    assert assert_safe(flown).error <= bound


@pytest.mark.long
@pytest.mark.parametrize("seed", [71, 105])
def test_more_sensing_radius_and_margin_compensate_clocks_that_hide_ages(
    seed: int, fly: Fly, make_swarm: Callable[..., Swarm]
) -> None:
    starts = random_starts(make_swarm(SWARM), Starts(box=(6.0, 6.0), fixed=(0,)), Random(seed))
    drones = [{"id": i, "start": [x, y, 0.0]} for i, (x, y) in enumerate(starts)]
    flown = fly(SWARM | PATIENT | ALL | CAREFUL | {"drones": drones}, seed=seed, duration=9.0)
    assert flown.outcome.failure == ""
    assert assert_safe(flown).error <= 0.040


def test_a_drone_with_old_poses_holds_and_is_safe(fly: Fly) -> None:
    flown = fly(SWARM | ALL, seed=3, duration=9.0)
    told = [(phase, why) for i in (1, 2, 3, 4) for _, phase, why in flown.phases(f"uav{i}")]
    assert ("hold", "own pose is stale") in told
    assert_safe(flown)


def test_a_network_that_loses_a_third_is_no_reason_to_doubt_the_tracker(fly: Fly) -> None:
    """With the limits of docs/radio.md; a drone that hovers as it got no command stands where it stood, bit for bit."""
    staleness = {"pose_zero": 0.6, "pose_land": 2.0, "nearby_slow": 0.6, "nearby_hold": 1.0, "command_zero": 0.8}
    limits = {"speed": 1.5, "staleness": staleness | {"command_land": 2.0, "estimate_drop": 0.5}}
    rates = {"control.rate_hz": 20, "gateway.rate_hz": 20, "avoidance.margin": 0.1, "avoidance.sensing_radius": 3.0}
    poor = {"sim.delay": 0.05, "sim.jitter": 0.02, "sim.loss": 0.3}
    table = {key: value for key, value in SWARM.items() if key != "obstacles"}
    flown = fly(table | {"limits": limits} | rates | poor, seed=5, duration=25.0)
    assert flown.outcome.failure == ""


@pytest.mark.parametrize("at", [2.2, 2.4, 2.6])  # s from the order to take off: two meet head on
@pytest.mark.parametrize("command_zero", [0.2, 0.5])
def test_drones_that_hear_nothing_any_more_stop_in_time(command_zero: float, at: float, fly: Fly) -> None:
    silence = {"at": at, "kind": "partition", "processes": ["kinematics"], "duration": 5.0}
    flown = fly(SWARM | {"limits.staleness.command_zero": command_zero}, silence, seed=148, duration=3.0)
    print(kept(flown))
    assert kept(flown).closest >= 0.25


def test_a_wind_as_fast_as_the_airframe_lets_it_land(fly: Fly) -> None:
    windy = {"control.disturbance": 1.3, "limits.body_drift": 1.5, "wind.velocity": [1.3, 0.0, 0.0]}
    drones = [{"id": i, "start": [x, y, 0.0], "airframe": "tello"} for i, (x, y) in enumerate(STARTS)]
    flown = fly({"control.law": "extended", "drones": drones} | windy, duration=4.0)
    assert "still landing" not in flown.outcome.failure
    assert {flown.phases(f"uav{i}")[-1][1] for i in (1, 2, 3, 4)} <= {"grounded", "ready"}
