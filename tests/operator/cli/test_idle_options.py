"""`flockwire check` warns of each option that does nothing, and of none that does something."""

from pathlib import Path

import pytest
from flockwire_core.loading import load_swarm
from flockwire_core.parameters import pilot_parameters
from flockwire_core.swarm.model import Swarm
from flockwire_operator.station.warnings import IDLE, idle, warnings

SWARMS = sorted((Path(__file__).parents[3] / "examples").glob("*.toml"))
VALUES = {  # of options whose default does not stand for itself, or that is a table
    "observer.leader_time_constant": 0.3,
    "gateway.twin": {},
    "gateway.replay": {"trace": "a.mcap"},
    "gateway.natnet.group": "239.255.42.99",
    "leader.trajectory": {"kind": "circle"},
    "gateway.ros.bodies": ["uav4", "uav3", "uav2", "uav1", "uav0"],
}
TELEOPERATED, UNFILTERED = {"leader.kind": "teleoperated"}, {"control.safety_filter": False}
CARRIED, EXTENDED = {"leader.kind": "tracked", "drones.0.start": [0.0, 0.0, 1.2]}, {"control.law": "extended"}
FROM_ROS = {"gateway.source": "ros"}
REAL = {f"drones.{i}.airframe": "tello" for i in range(5)} | {
    f"drones.{i}.tello": {"address": f"192.0.2.{i}", "local_ip": f"192.0.2.{100 + i}"} for i in range(5)
}
CASES = {  # by the first option of a row: where its options do nothing, and where each does something
    "control.compensation_gain": (EXTENDED, {"control.law": "paper"}),
    "avoidance.drone_gain": (EXTENDED, EXTENDED | UNFILTERED),
    "observer.leader_time_constant": ({}, EXTENDED),
    "avoidance.barrier_rate": ({}, EXTENDED | UNFILTERED),
    "limits.floor": ({}, EXTENDED),
    "avoidance.sensing_radius": ({"avoidance.sensing": "neighbours"}, {}),
    "limits.blind_speed": (
        {"avoidance.sensing": "neighbours"},
        {"avoidance.sensing": "neighbours", "drones.2.airframe": "tello"},
    ),
    "wind.velocity": (REAL | {"gateway.source": "natnet"}, {"drones.2.airframe": "tello"}),
    "network.link": ({"network.security": "none"}, {}),
    "leader.acceleration": ({}, TELEOPERATED),
    "leader.speed": ({}, CARRIED),
    "leader.tracking_gain": (TELEOPERATED, {}),
    "leader.start": ({}, {"leader.kind": "virtual", "drones.0": None}),
    "leader.trajectory": (TELEOPERATED, CARRIED),
    "leader.ros": ({}, {"leader.kind": "ros", "ros": {}}),
    "gateway.ros.topic": (FROM_ROS | {"gateway.ros.array": "/poses"}, FROM_ROS),
    "gateway.ros.bodies": (FROM_ROS, FROM_ROS | {"gateway.ros.array": "/poses"}),
    "gateway.rotation": ({}, {"gateway.source": "natnet"}),
    "gateway.twin": ({}, {"gateway.source": "natnet"}),
    "gateway.natnet.group": (
        {"gateway.source": "natnet"},
        {"gateway.source": "natnet", "gateway.natnet.multicast": True},
    ),
} | {
    f"gateway.{source}": ({}, {"gateway.source": source})
    for source in ("natnet", "vrpn", "qualisys", "vicon", "ros", "replay")
}
OPTIONS = [(options[0], option) for options, *_ in IDLE for option in options]


def value(option):
    """Return what a file may set an option to: its default, or a value of its kind."""
    table = Swarm.model_construct(graph=None, drones=()).model_copy()
    for part in option.split("."):
        table = getattr(table, part)
    found = VALUES.get(option, table)
    return found.model_dump(exclude_none=True) if hasattr(found, "model_dump") else found


def named(swarm, option):
    return [line for line in idle(swarm) if line.startswith(f"{option} is set")]


@pytest.mark.parametrize(("first", "option"), OPTIONS, ids=[f"{option}" for _, option in OPTIONS])
def test_an_option_is_named_where_it_does_nothing_and_only_there(make_swarm, first, option):
    nothing, something = CASES[first]
    without = {"leader.trajectory": None} if option == "leader.trajectory" else {}
    assert not named(make_swarm(without | nothing), option)  # it is not set
    (line,) = named(make_swarm(nothing | {option: value(option)}), option)
    assert line.startswith(f"{option} is set but has no effect: the file has ")
    assert not named(make_swarm(something | {option: value(option)}), option)


@pytest.mark.parametrize(
    ("changes", "option"),
    [
        ({"leader.kind": "ros", "ros": {}}, "leader.tracking_gain"),  # towards a PoseStamped
        (EXTENDED, "avoidance.drone_influence_radius"),  # of a place that a drone takes, in the figures
        ({}, "avoidance.margin"),  # of a landing without poses, and of a place that is taken
    ],
)
def test_no_option_is_named_that_does_something(make_swarm, changes, option):
    assert not named(make_swarm(changes | {option: value(option)}), option)


def test_a_disturbance_without_a_safety_filter_reaches_no_pilot(make_swarm):
    least = {"control.disturbance": 0.6, "limits.body_drift": 0.2}
    assert pilot_parameters(make_swarm(least), 1) == pilot_parameters(make_swarm({"limits.body_drift": 0.2}), 1)
    assert pilot_parameters(make_swarm(EXTENDED | least), 1).disturbance == 0.6


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"control.law": "extended", "avoidance.drone_gain": 0.3}, "control.law = 'extended', and a safety filter"),
        ({"gateway.vrpn": {}}, "gateway.source = 'simulated'"),
        ({"gateway.natnet.data_port": 1511, "gateway.source": "natnet"}, "gateway.natnet.multicast = false"),
    ],
)
def test_it_says_what_the_file_has(make_swarm, changes, reason):
    (line,) = idle(make_swarm(changes))
    assert line.endswith(f" is set but has no effect: the file has {reason}")


def test_check_warns_of_it(make_swarm):
    assert any("network.link is set but has no effect" in line for line in warnings(
        make_swarm({"network.security": "none", "network.link": "quic"})
    ))  # fmt: skip


@pytest.mark.parametrize("path", SWARMS, ids=lambda path: path.stem)
def test_no_shipped_swarm_sets_an_idle_option(path):
    assert list(idle(load_swarm(path))) == []
