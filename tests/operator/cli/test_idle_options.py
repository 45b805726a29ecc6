"""`flockwire check` warns of each option that does nothing, and of none that does something."""

from pathlib import Path

import pytest
from flockwire_core.loading import load_swarm
from flockwire_core.swarm.model import Swarm
from flockwire_operator.station.check import warnings
from flockwire_operator.station.idle_options import IDLE, idle

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
CASES = {  # by what the file has: where the options of that row do nothing, and where each does something
    "control.law = 'extended'": (EXTENDED, {"control.law": "paper"}),
    "control.law = 'extended' with its safety filter": (EXTENDED, EXTENDED | UNFILTERED),
    "control.law = 'paper'": ({}, EXTENDED),
    "control.law = 'paper' without a safety filter": ({}, {"control.safety_filter": True}),
    "no safety filter": ({}, EXTENDED),
    "avoidance.sensing = 'neighbours'": ({"avoidance.sensing": "neighbours"}, {}),
    "avoidance.sensing = 'neighbours', and no airframe with a driver of its own": (
        {"avoidance.sensing": "neighbours"},
        {"avoidance.sensing": "neighbours", "drones.2.airframe": "tello"},
    ),
    "no simulated drone": (REAL | {"gateway.source": "natnet"}, {"drones.2.airframe": "tello"}),
    "network.security = 'none'": ({"network.security": "none"}, {}),
    "a leader that is not steered": ({}, TELEOPERATED),
    "a leader that is not steered or carried": ({}, CARRIED),
    "a leader of another kind than 'trajectory'": (TELEOPERATED, {}),
    "a leader of another kind than 'virtual'": ({}, {"leader.kind": "virtual", "drones.0": None}),
    "a leader that is steered": (TELEOPERATED, CARRIED),
    "another leader.kind than 'ros'": ({}, {"leader.kind": "ros", "ros": {}}),
    "gateway.ros.array": (FROM_ROS | {"gateway.ros.array": "/poses"}, FROM_ROS),
    "no gateway.ros.array": (FROM_ROS, FROM_ROS | {"gateway.ros.array": "/poses"}),
    "gateway.source = 'simulated'": ({}, {"gateway.source": "natnet"}),
    "a gateway.source that a simulated tracker cannot serve": ({}, {"gateway.source": "natnet"}),
    "gateway.natnet.multicast = false": (
        {"gateway.source": "natnet"},
        {"gateway.source": "natnet", "gateway.natnet.multicast": True},
    ),
} | {
    f"another gateway.source than {source!r}": ({}, {"gateway.source": source})
    for source in ("natnet", "vrpn", "qualisys", "vicon", "ros", "replay")
}
OPTIONS = [(row, option) for row in IDLE for option in row.options]


def value(option):
    """Return what a file may set an option to: its default, or a value of its kind."""
    table = Swarm.model_construct(graph=None, drones=()).model_copy()
    for part in option.split("."):
        table = getattr(table, part)
    found = VALUES.get(option, table)
    return found.model_dump(exclude_none=True) if hasattr(found, "model_dump") else found


def named(swarm, option):
    return [line for line in idle(swarm) if line.startswith(f"{option} is set")]


@pytest.mark.parametrize(("row", "option"), OPTIONS, ids=[f"{option}" for _, option in OPTIONS])
def test_an_option_is_named_where_it_does_nothing_and_only_there(make_swarm, row, option):
    nothing, something = CASES[row.because]
    without = {"leader.trajectory": None} if option == "leader.trajectory" else {}
    assert not named(make_swarm(without | nothing), option)  # it is not set
    (line,) = named(make_swarm(nothing | {option: value(option)}), option)
    assert line == f"{option} is set but has no effect: the file has {row.because}"
    assert not named(make_swarm(something | {option: value(option)}), option)


def test_check_warns_of_it(make_swarm):
    assert any("network.link is set but has no effect" in line for line in warnings(
        make_swarm({"network.security": "none", "network.link": "quic"})
    ))  # fmt: skip


@pytest.mark.parametrize("path", SWARMS, ids=lambda path: path.stem)
def test_no_shipped_swarm_sets_an_idle_option(path):
    assert list(idle(load_swarm(path))) == []
