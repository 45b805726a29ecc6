"""Which links a file of faults concerns in a real flight, and what is refused in one line."""

import asyncio

import pytest
from flockwire.flight.faults import parse_faults
from flockwire_cli.misfortune import Misfortune, refusal
from flockwire_cli.relay.links import Links, directions

CUT = {"at": 1.0, "kind": "cut", "from": "uav1", "to": "uav2", "duration": 1.0}
SLOW = {"at": 2.0, "kind": "link", "from": "gateway", "to": "uav1", "duration": 1.0, "delay": 0.1, "jitter": 0.02}
PART = {"at": 3.0, "kind": "partition", "processes": ["uav3", "uav4"], "duration": 1.0}
TWO_HOSTS = {"hosts": {"ground": {}, "air": {"address": "10.0.0.2"}}, "drones.2.host": "air"}


def read(swarm, *tables):
    return parse_faults({"faults": list(tables)}, swarm, "f.toml")


def test_a_flight_takes_what_tcp_can_do(make_swarm):
    swarm = make_swarm()
    assert refusal(read(swarm, CUT, SLOW, PART), swarm, "local") == ""


@pytest.mark.parametrize(
    ("changes", "fault", "line"),
    [
        (None, SLOW | {"loss": 0.5}, "faults.0.loss = 0.5: must be 0 in a real flight, whose links are TCP"),
        (None, SLOW | {"reordering": 0.01}, "faults.0.reordering = 0.01: must be 0 in a real flight, whose links are"),
        ({"network.mode": "router"}, CUT, "faults.0.kind = 'cut': all links go to the router; a real flight needs "),
        ({"network.mode": "router"}, PART, "faults.0.kind = 'partition': all links go to the router; a real "),
        (TWO_HOSTS, CUT, "faults.0.kind = 'cut': uav2, who dials uav1, must run on the recorder's host, 'ground', "),
        (None, {"at": 1, "kind": "clock", "process": "uav1", "step": 1.0}, "faults.0.kind = 'clock': only `flockwire"),
    ],
)
def test_what_a_real_flight_cannot_have_is_refused_in_one_line(make_swarm, changes, fault, line):
    swarm = make_swarm(changes)
    host = next(iter(swarm.hosts))
    said = refusal(read(swarm, fault), swarm, host)
    assert said.startswith(line)
    assert "\n" not in said


def test_a_host_that_does_not_conduct_leaves_links_to_the_one_that_does(make_swarm):
    swarm = make_swarm(TWO_HOSTS)
    assert refusal(read(swarm, CUT), swarm, "air") == ""


def test_a_partition_parts_both_ways_and_nobody_from_recorder_and_operator(make_swarm):
    swarm = make_swarm()
    (partition,) = read(swarm, PART)
    parted = set(directions(partition, swarm))
    outside = {("uav2", "uav3")} | {(other, uav) for other in ("gateway", "kinematics") for uav in ("uav3", "uav4")}
    assert parted == outside | {(target, source) for source, target in outside}


def test_only_links_that_a_fault_names_have_a_relay(make_swarm):
    async def run():
        swarm = make_swarm()
        async with Links(read(swarm, CUT, SLOW), swarm) as links:
            told = links.detours
        async with Links((), swarm) as none:
            assert none.detours == {}
        return told

    told = asyncio.run(run())
    assert {dialler: list(found) for dialler, found in told.items()} == {"uav2": ["uav1"], "uav1": ["gateway"]}
    addresses = [address for found in told.values() for address in found.values()]
    assert all(address.startswith("127.0.0.1:") for address in addresses)
    assert len(set(addresses)) == 2


def test_links_break_and_mend_when_the_faults_say(make_swarm):
    swarm = make_swarm()
    links = Links(faults := read(swarm, CUT | {"at": 0.5}, SLOW, PART), swarm)
    misfortune = Misfortune(faults, (), None, links)
    seen = []
    for tenths in (4, 5, 14, 15, 20, 30, 40):
        misfortune.step(tenths * 10**8)
        cut = {ends for ends, way in links._ways.items() if not way.passable}
        slow = {ends for ends, way in links._ways.items() if way.arrival(0.0, 0.0) > 0.0}
        seen.append((cut, slow))
    parted = set(directions(faults[2], swarm))
    assert seen == [
        (set(), set()),
        ({("uav1", "uav2")}, set()),
        ({("uav1", "uav2")}, set()),
        (set(), set()),
        (set(), {("gateway", "uav1")}),
        (parted, set()),
        (set(), set()),
    ]
