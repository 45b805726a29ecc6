"""The rules that tie a swarm file's keys together; those of hosts and addresses are in wire/test_address_rules.py."""

import pytest
from flockwire_core.loading import SwarmFileError
from flockwire_core.swarm.formation_rules import survey_of

VIRTUAL = {"leader.kind": "virtual", "drones.0": None}
TRACKED = {"leader.kind": "tracked", "drones.0.start": [0.0, 0.0, 1.2]}
TELLOS = {"drones.1.airframe": "tello", "drones.2.airframe": "tello"}
LOOP = [[0, 1], [1, 2], [2, 3], [3, 4], [4, 1]]
WRONG = [
    # drones
    ({"drones.2.id": 1}, "drones.2.id = 1: another drone has this id"),
    (
        {"drones.1.airframe": "kite"},
        "drones.1.airframe = 'kite': must be one of [airframes], ['kinematics', 'multirotor', 'tello']",
    ),
    # Tellos
    ({"drones.1.tello": {}}, "drones.1.tello: airframe 'kinematics' is of kind 'kinematics', must be 'tello'"),
    (
        {"drones.1.airframe": "tello", "drones.1.tello": {"address": "::1"}},
        "drones.1.tello.address = '::1': must be an IPv4 address",
    ),
    (
        {"drones.1.airframe": "tello", "drones.1.tello": {"address": "192.168.10.1"}},
        "drones.1.tello.address = '192.168.10.1': no tracker sees uav1, gateway.source = 'simulated'",
    ),
    (
        TELLOS | {f"drones.{i}.tello": {"address": "127.0.0.9"} for i in (1, 2)},
        "drones.tello.address = '127.0.0.9': uav2 and uav1 have one address",
    ),
    (
        TELLOS | {f"drones.{i}.tello": {"local_ip": "127.0.0.9"} for i in (1, 2)},
        "drones.tello.local_ip: the drivers of uav1 and uav2 would both bind 127.0.0.9, port 8889",
    ),
    (
        TELLOS | {"limits.staleness.command_land": 15.0},
        "limits.staleness.command_land = 15.0: must be below 15 s, after which airframe 'tello' lands by itself",
    ),
    (
        TELLOS | {"limits.staleness.telemetry_land": 16.0},
        "limits.staleness.telemetry_land = 16.0: must be below 15 s, after which airframe 'tello' lands by itself",
    ),
    (
        {"airframes": {"tello": {"stick_gains": {"right": 0.0}}}},
        "airframes.tello.stick_gains.right = 0.0: must be a number above 0",
    ),
    ({"drones.1.host": "mars"}, "drones.1.host = 'mars': must be one of [hosts], ['local']"),
    ({"drones": [{"id": 0, "start": [0, 0, 0]}]}, "drones: at least one follower"),
    ({"drones.0": None}, "drones: the leader, id 0, is missing (leader.kind = 'trajectory'"),
    ({"leader.kind": "virtual"}, "drones: id 0 is a leader, and leader.kind = 'virtual' has no drone"),
    # a person who leads
    (TRACKED | {"drones.0": None}, "drones: the leader, id 0, is missing (leader.kind = 'tracked' has its own body"),
    ({"leader.kind": "tracked"}, "drones.0.start = [0.0, 0.0, 0.0]: leader.kind = 'tracked' is carried by a person"),
    (
        TRACKED | {"drones.1.start": [0.0, 0.6, 0.0]},
        "drones.1.start = [0.0, 0.6, 0.0]: 0.60 m from the person who leads, must be 0.7 m or more",
    ),
    (TRACKED | {"formation.radius": 0.6}, "formation: its drones come within 0.60 m of the person who leads"),
    (TRACKED | {"avoidance.sensing": "neighbours"}, "avoidance.sensing = 'neighbours': does not sense the person"),
    # hosts
    ({"hosts": {}}, "hosts: at least one host is needed"),
    ({"hosts.a.address": "nowhere"}, "hosts.a.address = 'nowhere': must be an IP address"),
    # wind and places
    ({"control.disturbance": 3.0}, "control.disturbance = 3.0: must be below limits.speed = 3.0"),
    (
        {"formation.places": "fixed", "formation.assignment": "free"},
        "formation.assignment = 'free': excludes formation.places = 'fixed'",
    ),
    (
        {"formation.places": "fixed", "formation.assignment": "auction", "graph.edges": LOOP},
        "formation.assignment = 'auction': excludes formation.places = 'fixed'",
    ),
    (
        {"formation.assignment": "auction"},
        "formation.assignment = 'auction': the links between followers do not lead from uav2 to uav1; must lead from "
        "each to every other one (graph.edges)",
    ),
    (
        {"formations": {"row": {"kind": "line", "assignment": "auction"}}},
        "formations.row.assignment = 'auction': the links between followers do not lead from uav2 to uav1",
    ),
    ({"wind.gust": -1.0}, "wind.gust = -1.0: must be a number of 0 or more"),
    # graph
    ({"graph.edges.1": [1, 7]}, "graph.edges.1 = [1, 7]: there is no drone 7"),
    ({"graph.edges.0": [0, 0]}, "graph.edges.0 = [0, 0]: a leader has no in-neighbours"),
    ({"graph.edges.2": [2, 2]}, "graph.edges.2 = [2, 2]: a drone is not its own neighbour"),
    ({"graph.edges.2": [1, 2]}, "graph.edges.2 = [1, 2]: this edge appears twice"),
    ({"graph.edges.1": [4, 3]}, "graph.edges: no spanning tree from a leader: none reaches uav2, uav3, uav4"),
    ({"graph.edges": []}, "graph.edges: no spanning tree from a leader: none reaches uav1, uav2, uav3, uav4"),
    # addresses
    ({"drones.1.address": "10.0.0.1"}, "drones.1.address = '10.0.0.1': must be IP:PORT"),
    ({"drones.1.address": "10.0.0.1:80"}, "drones.1.address = '10.0.0.1:80': must be IP:PORT, PORT from 1024"),
    ({"drones.1.address": "10.0.0.1:²"}, "drones.1.address = '10.0.0.1:²': must be IP:PORT"),
    ({"drones.1.address": "drone:9000"}, "drones.1.address = 'drone:9000': must be IP:PORT"),
    # rates
    ({"gateway.rate_hz": 50}, "gateway.rate_hz = 50: must be control.rate_hz = 100 or more"),
    # avoidance
    (
        {"avoidance.drone_influence_radius": 0.4},
        "avoidance.drone_influence_radius = 0.4: must be above avoidance.drone_safety_distance = 0.4",
    ),
    (
        {"avoidance.obstacle_safety_distance": 0.6},
        "avoidance.obstacle_influence_radius = 0.5: must be above avoidance.obstacle_safety_distance = 0.6",
    ),
    (
        {"avoidance.sensing_radius": 0.6, "avoidance.drone_influence_radius": 0.7},
        "avoidance.sensing_radius = 0.6: must be avoidance.drone_influence_radius = 0.7 or more",
    ),
    # fence and starts
    ({"limits.fence.min": [-9.0, 10.0, -0.5]}, "limits.fence.min = [-9.0, 10.0, -0.5]: must be below limits.fence.max"),
    (
        {"drones.3.start": [11.0, 0.0, 0.0]},
        "drones.3.start = [11.0, 0.0, 0.0]: must lie inside limits.fence, is 1.00 m outside",
    ),
    (
        {"limits.fence": {"polygon": [[-5, -5], [5, -5], [5, 5], [-1, 5], [-1, 0.5], [-5, 0.5]]}},
        "drones.4.start = [-2.8, 0.9, 0.0]: must lie inside limits.fence, is 0.40 m outside",
    ),
    ({"limits.fence": {"floor": 3.0, "ceiling": 2.0}}, "limits.fence.floor = 3.0: must be below limits.fence.ceiling"),
    ({"limits.fence": {"polygon": [[0, 0], [1, 1]]}}, "limits.fence.polygon = [[0.0, 0.0], [1.0, 1.0]]: must have 3"),
    (
        {"limits.fence": {"polygon": [[-5, -5], [5, 5], [5, -5], [-5, 5]]}},
        "limits.fence.polygon = [[-5.0, -5.0], [5.0, 5.0], [5.0, -5.0], [-5.0, 5.0]]: must not cross or touch itself, "
        "that from [-5.0, -5.0] to [5.0, 5.0] meets that from [5.0, -5.0] to [-5.0, 5.0]",
    ),
    (
        {"limits.fence": {"polygon": [[-5, -5], [5, 5], [5, 5], [-5, 5]]}},
        "limits.fence.polygon = [[-5.0, -5.0], [5.0, 5.0], [5.0, 5.0], [-5.0, 5.0]]: corner [5.0, 5.0] appears twice",
    ),
    ({"limits.fence": {"polygon": [[-5, "a"]]}}, "limits.fence.polygon.0.1 = 'a': must be"),
    ({"limits.fence": {"polygon": 5}}, "limits.fence.polygon = 5: must be"),
    (
        {"limits.fence": {"polygon": [[-9, -9], [9, -9], [0, 9]], "ceiling": 0.5}},
        "limits.takeoff_height = 1.0: must be",
    ),
    (
        {"drones.3.start": [0.6, -2.3, 1.5], "limits.fence": {"ceiling": 2.2}},
        "limits.takeoff_height = 1.0: must be 0.7 m or less: it counts from drones.3.start, 1.5 m high, and the "
        "fence's top is 2.2 m",
    ),
    ({"drones.3.start": [0.0, 0.3, 0.0]}, "drones.3.start = [0.0, 0.3, 0.0]: 0.30 m from drones.0.start, must be"),
    (
        {"obstacles": [{"center": [3.0, -0.8, 0.0], "radius": 0.05}]},
        "drones.2.start = [2.9, -0.8, 0.0]: 0.05 m from obstacle 0, must be 0.3 m or more",
    ),
    # formations
    (
        {"formation": {"kind": "expression", "x": "2 + i", "y": "1 / (t - 3)"}},
        "formation.y = '1 / (t - 3)': it or its rate has no finite value at t = 3.0 s for uav1 (i = 0); must have one",
    ),
    (
        {"formations.root": {"kind": "expression", "x": "2 + i", "y": "sqrt(t)"}},
        "formations.root.y = 'sqrt(t)': it or its rate has no finite value at t = 0.0 s for uav1 (i = 0); must",
    ),
    (
        {"formations.fast": {"kind": "expression", "x": "2 + i", "y": "2*sin(2*t)"}},
        "formations.fast: its drones fly up to 4.00 m/s, limits.speed = 3.0 m/s",
    ),
    (
        {"formation": {"kind": "expression", "x": "w*t", "y": "0"}},
        "formation.x = 'w*t': 'w' is not known; it may use t, i, n, pi, e and the functions sin, cos",
    ),
    ({"formations.kink": {"kind": "expression", "x": "abs(t)", "y": "0"}}, "formations.kink.x = 'abs(t)': 'abs' of"),
    ({"formation.rate": 1.6}, "formation: its drones fly up to 3.20 m/s, limits.speed = 3.0 m/s"),
    (
        {"formation.radius": 0.25},
        "formation: its drones come within 0.25 m, must be 0.4 m or more (avoidance.drone_safety_distance)",
    ),
    (
        {"formation.radius": 11.0, "formation.rate": 0.0},
        "formation: is 22.00 m wide along x, with the leader; limits.fence is 20.00 m wide",
    ),
    (
        {"formations.tight": {"kind": "line", "spacing": 0.1}},
        "formations.tight: its drones come within 0.10 m, must be 0.4 m or more (avoidance.drone_safety_distance)",
    ),
    ({**VIRTUAL, "formation.radius": 0.25}, "formation: its drones come within 0.35 m"),
    (
        {"control.law": "extended", "formation": {"kind": "line", "spacing": 0.42}},
        "formation: its drones come within 0.42 m, must be 0.43 m or more (avoidance.drone_safety_distance + avoid",
    ),
    ({"formation": {"kind": "line", "spacing": 0.3999}}, "formation: its drones come within 0.3999 m, must be 0.4 m"),
    (
        {"drones.1.start": [0.39996, 0.0, 0.0]},
        "drones.1.start = [0.39996, 0.0, 0.0]: 0.39996 m from drones.0.start, must be avoidance.drone_safety_dist",
    ),
    (
        {"obstacles": [{"center": [0.0, 0.29999, 0.0]}]},
        "drones.0.start = [0.0, 0.0, 0.0]: 0.29999 m from obstacle 0, must be 0.3 m or more",
    ),
]


@pytest.mark.parametrize(("changes", "line"), WRONG, ids=[line.partition(":")[0] for _, line in WRONG])
def test_a_broken_rule_names_key_value_and_rule(make_swarm, changes, line):
    with pytest.raises(SwarmFileError) as refused:
        make_swarm(changes)
    lines = str(refused.value).split("\n")
    assert any(found.startswith(f"test.toml: {line}") for found in lines), lines


def test_every_unsound_pair_of_starts_is_named(make_swarm):
    with pytest.raises(SwarmFileError) as refused:
        make_swarm({"drones": [{"id": i, "start": [0.05 * i, 0.0, 0.0]} for i in range(5)]})
    assert len(str(refused.value).split("\n")) == 10


@pytest.mark.parametrize(
    "changes",
    [
        VIRTUAL,
        {**VIRTUAL, "formation.radius": 0.3},  # nobody is in the middle
        {"graph.edges": [[0, i] for i in range(1, 5)]},
        {"drones.1.address": "10.0.0.1:9000"},
        {"drones.1.address": "[::1]:9000"},
        {"hosts.a.address": "::1"},
        {"avoidance.sensing": "neighbours"},
        {"formation": {"kind": "grid", "spacing": 0.5}},
        {"drones.2.id": 999, "graph.edges": [[0, 1], [1, 999], [999, 3], [3, 4]]},
    ],
)
def test_what_keeps_the_rules_is_accepted(make_swarm, changes):
    assert make_swarm(changes) != make_swarm()


@pytest.mark.parametrize(("x", "fits"), [("6 + 2*i", True), ("6 + 4.1*i", False)])
def test_a_formation_on_one_side_of_a_virtual_leader_needs_only_its_own_box(make_swarm, x, fits):
    aside = {
        **VIRTUAL,
        "formation": {"kind": "expression", "x": x, "y": "0"},
        "leader.trajectory": {"kind": "constant", "velocity": [0.0, 0.0, 0.0]},
        "limits.fence": {"min": [-2.0, -6.0, -0.5], "max": [10.0, 6.0, 3.0]},
        "drones": [
            {"id": i + 1, "start": [x, y, 0.0]} for i, (x, y) in enumerate(((6.0, 0.0), (8.0, 0.0), (7.0, 2.0)))
        ],
        "graph.edges": [[0, 1], [0, 2], [0, 3]],
    }
    if fits:
        assert survey_of(make_swarm(aside)).low[0] == 6.0
    else:
        aside["limits.fence"]["max"][0] = 6.0
        with pytest.raises(SwarmFileError, match=r"is 8\.20 m wide along x; limits\.fence is 8\.00 m wide"):
            make_swarm(aside)
