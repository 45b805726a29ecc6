"""Flights in virtual time in which some or all drones are Tellos, each behind its own driver."""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations, pairwise
from math import dist

import pytest
from flockwire_core.domain.airframe import FlightState

Fly = Callable[..., object]
MIXED = {"drones.1.airframe": "tello", "drones.3.airframe": "tello", "drones.3.heading": 2.0,
         "control.law": "extended", "formation.rate": 0.2, "formation.radius": 1.5,
         "airframes.kinematics": {"lag": 0.25, "dead_time": 0.1}}  # fmt: skip


def positions(flown, begin: float = -99.0, end: float = 1e9) -> list[dict[str, tuple[float, float, float]]]:
    """Return where all drones were, frame by frame."""
    frames: dict[int, dict[str, tuple[float, float, float]]] = {}
    for t, published, message in flown.published:
        if published.key.kind == "truth" and begin <= t <= end:
            frames.setdefault(message.stamp, {})[published.key.owner] = message.position
    return list(frames.values())


def closest(flown) -> float:
    airborne = [[p for p in frame.values() if p[2] > 0.15] for frame in positions(flown)]
    return min(dist(a, b) for frame in airborne for a, b in combinations(frame, 2))


@pytest.fixture(scope="module")
def mixed(fly: Fly):
    """Fly Tellos beside other airframes; one driver is killed on the way."""
    return fly(MIXED, {"at": 8.0, "kind": "kill", "process": "driver1"}, duration=15.0)


def test_tellos_and_other_airframes_fly_one_formation(mixed) -> None:
    assert mixed.outcome.failure == ""
    for identity in ("uav1", "uav2", "uav3", "uav4"):
        settled = [status.report.formation_error for _, status in mixed.of("status", identity, 13.0, 14.5)]
        assert max(settled) < 0.02, identity
    assert closest(mixed) > 0.4
    assert all(place[2] < 0.02 for place in positions(mixed)[-1].values())


def test_a_driver_that_is_killed_is_restarted_and_takes_its_drone_over(mixed) -> None:
    told = mixed.of("telemetry", "uav1", 6.0, 14.0)
    silence = max(b - a for (a, _), (b, _) in pairwise(told))
    assert 0.5 < silence < 1.5
    assert {message.state for _, message in told} == {FlightState.FLYING}
    track = [frame["uav1"] for frame in positions(mixed, 7.5, 11.0)]
    assert max(dist(a, b) for a, b in pairwise(track)) < 0.02  # 2 m/s: no jump


def test_a_stop_makes_a_tello_fall_as_any_other(fly: Fly) -> None:
    flown = fly(MIXED, duration=12.0, prepare=lambda world: world.scheduler.at(
        world.scheduler.now + 7 * 10**9, lambda _: world.stop("test")))  # fmt: skip
    assert flown.outcome.failure
    stopped = [m for _, m in flown.of("telemetry", "uav1")][-1]
    assert stopped.state is FlightState.STOPPED


@pytest.mark.long
def test_equal_seeds_fly_tellos_equally(fly: Fly) -> None:
    one, other = (fly(MIXED | {"gateway.noise": 0.001}, seed=3, duration=4.0) for _ in range(2))
    assert [p.sample.payload for _, p, _ in one.published] == [p.sample.payload for _, p, _ in other.published]


@pytest.mark.parametrize(
    "slow",
    [
        pytest.param({"limits.vertical_speed": 0.06}, marks=pytest.mark.long),
        pytest.param({"limits.vertical_speed": 0.2}, marks=pytest.mark.long),
        pytest.param({"avoidance.sensing_radius": 0.6}, marks=pytest.mark.long),
    ],
    ids=str,
)
def test_tellos_take_off_and_land_however_slow_the_limits_let_them(fly: Fly, slow: dict) -> None:
    flown = fly(MIXED | {"limits.takeoff_height": 0.7} | slow, duration=16.0)
    assert flown.outcome.failure == ""
    for identity in ("uav1", "uav3"):
        states = [message.state for _, message in flown.of("telemetry", identity)]
        assert FlightState.FLYING in states
        assert states[-1] is FlightState.GROUNDED


def test_faults_of_airframes_count_from_the_take_off_of_tellos_alone(fly: Fly) -> None:
    tellos = {f"drones.{i}.airframe": "tello" for i in range(5)}
    flown = fly(tellos, {"at": 8.0, "kind": "failure", "drone": 2}, duration=12.0)
    assert "uav2" in flown.outcome.failure
