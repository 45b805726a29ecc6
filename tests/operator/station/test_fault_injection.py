"""Which links a file of faults concerns in a real flight, and what is refused, a line for each."""

import asyncio
from types import SimpleNamespace

import pytest
from flockwire_core.runtime.job import read_detours
from flockwire_lab.faults.file import parse_faults
from flockwire_lab.relay.links import Relays
from flockwire_operator.station.fault_injection import FaultInjector, unable
from flockwire_operator.station.host import Host

CUT = {"at": 1.0, "kind": "cut", "from": "uav1", "to": "uav2", "duration": 1.0}
SLOW = {"at": 2.0, "kind": "link", "from": "gateway", "to": "uav1", "duration": 1.0, "delay": 0.1, "jitter": 0.02}
PART = {"at": 3.0, "kind": "partition", "processes": ["uav3", "uav4"], "duration": 1.0}
LIE = {"at": 1.0, "kind": "false_age", "drone": 2, "age": 0.0, "duration": 1.0}
KILL = {"at": 1.0, "kind": "kill", "process": "uav2"}
BLIND = {"at": 1.0, "kind": "tracker", "drone": 2, "duration": 0.5}
FALL = {"at": 1.0, "kind": "failure", "drone": 2}
WIND = {"at": 1.0, "kind": "wind", "velocity": [0.5, 0.0, 0.0], "duration": 1.0}
REAL = {"drones.2.airframe": "tello", "drones.2.tello": {"address": "10.0.0.2"}, "gateway": {"source": "natnet"}}
ALL_REAL = {
    "gateway": {"source": "natnet"},
    "drones": [
        {"id": i, "start": [i, 0.0, 0.0], "airframe": "tello"}
        | {"tello": {"address": f"10.0.0.{i + 2}", "local_ip": f"10.0.1.{i + 2}"}}
        for i in range(5)
    ],
}
TWO_HOSTS = {"hosts": {"ground": {"address": "10.0.0.1"}, "air": {"address": "10.0.0.2"}}, "drones.2.host": "air"}


def read(plan, *tables):
    return parse_faults({"faults": list(tables)}, plan, "f.toml")


def refusal(faults, plan, host):
    return "\n".join(
        line for place, fault in enumerate(faults) for line in unable(plan, host, f"faults.{place}", fault)
    )


def test_a_flight_takes_what_tcp_can_do(make_plan):
    plan = make_plan()
    assert refusal(read(plan, CUT, SLOW, PART), plan, "local") == ""
    plan = make_plan(REAL)
    assert refusal(read(plan, FALL | {"drone": 1}, WIND), plan, "local") == ""


@pytest.mark.parametrize(
    ("changes", "fault", "line"),
    [
        (None, SLOW | {"loss": 0.5}, "faults.0.loss = 0.5: must be 0 in a real flight, whose links are TCP"),
        (None, SLOW | {"reordering": 0.01}, "faults.0.reordering = 0.01: must be 0 in a real flight, whose links are"),
        ({"network.mode": "router"}, CUT, "faults.0.kind = 'cut': all links go to the router; a real flight needs "),
        ({"network.mode": "router"}, PART, "faults.0.kind = 'partition': all links go to the router; a real "),
        (
            {"network.link": "quic"},
            CUT,
            "faults.0.kind = 'cut': links are QUIC; a real flight needs network.link = 'tls'",
        ),
        (TWO_HOSTS, CUT, "faults.0.kind = 'cut': uav2, which dials uav1, must run on this host, 'ground', in a real"),
        (REAL, FALL, "faults.0.drone = 2: uav2 is a real drone; must be a simulated one"),
        (ALL_REAL, WIND, "faults.0.kind = 'wind': the swarm has no simulated drone"),
        (None, {"at": 1, "kind": "clock", "process": "uav1", "step": 1.0}, "faults.0.kind = 'clock': only `flockwire"),
    ],
)
def test_what_a_real_flight_cannot_have_is_refused_in_one_line(make_plan, changes, fault, line):
    plan = make_plan(changes)
    host = next(iter(plan.swarm.hosts))
    said = refusal(read(plan, fault), plan, host)
    assert said.startswith(line)
    assert "\n" not in said


def test_all_that_a_real_flight_cannot_have_is_refused_at_once(make_plan):
    plan = make_plan()
    clock = {"at": 9.0, "kind": "clock", "process": "uav2", "step": 0.1}
    said = refusal(read(plan, CUT, SLOW | {"loss": 0.1, "reordering": 0.2}, clock), plan, "local")
    assert [line.partition(" = ")[0] for line in said.split("\n")] == [
        "faults.1.loss", "faults.1.reordering", "faults.2.kind",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("host", "fault", "line"),
    [
        (
            "air",
            CUT,
            "faults.0.kind = 'cut': only 'ground', the recorder's host, knows the time; use --faults there, this",
        ),
        ("ground", KILL, "faults.0.process = 'uav2': uav2 runs on host 'air', this is 'ground'; only its own host can"),
        (
            "air",
            KILL,
            "faults.0.process = 'uav2': only 'ground', the recorder's host, knows the time; use --faults there",
        ),
        ("ground", KILL | {"process": "uav1"}, ""),
        ("ground", LIE, "faults.0.drone = 2: uav2 runs on host 'air', this is 'ground'; only its own host can"),
        ("air", LIE, ""),
        (
            "air",
            BLIND,
            "faults.0.kind = 'tracker': gateway runs on host 'ground', this is 'air'; only its own host can",
        ),
        ("ground", BLIND, ""),
    ],
)
def test_of_several_hosts_each_injects_what_it_can_and_refuses_the_rest(make_plan, host, fault, line):
    plan = make_plan(TWO_HOSTS)
    said = refusal(read(plan, fault), plan, host)
    assert said.startswith(line) if line else said == ""


def test_a_partition_cuts_both_directions_and_nobody_from_recorder_and_operator(make_plan):
    plan = make_plan()
    (partition,) = read(plan, PART)
    parted = set(partition.directions(plan))
    outside = {("uav2", "uav3")} | {(other, uav) for other in ("gateway", "kinematics") for uav in ("uav3", "uav4")}
    assert parted == outside | {(target, source) for source, target in outside}


def test_only_links_that_a_fault_names_have_a_relay(make_plan):
    async def run():
        plan = make_plan()
        async with Relays(read(plan, CUT, SLOW), plan) as relays:
            detours = relays.detours
            assert {who: read_detours(found) for who, found in relays.environments.items()} == detours
        async with Relays((), plan) as none:
            assert none.detours == {}
        return detours

    detours = asyncio.run(run())
    assert {dialler: list(found) for dialler, found in detours.items()} == {"uav2": ["uav1"], "uav1": ["gateway"]}
    addresses = [address for found in detours.values() for address in found.values()]
    assert all(address.startswith("127.0.0.1:") for address in addresses)
    assert len(set(addresses)) == 2


def test_links_break_and_recover_when_the_faults_say(make_plan):
    plan = make_plan()
    relays = Relays(faults := read(plan, CUT | {"at": 0.5}, SLOW, PART), plan)
    injector = FaultInjector(faults, Host(plan, None, "nowhere", None, None), None, relays)
    seen = []
    for tenths in (4, 5, 14, 15, 20, 30, 40):
        injector.step(tenths * 10**8)
        cut = {ends for ends, direction in relays._directions.items() if not direction.passable}
        slow = {ends for ends, direction in relays._directions.items() if direction.arrival(0.0, 0.0) > 0.0}
        seen.append((cut, slow))
    parted = set(faults[2].directions(plan))
    assert seen == [
        (set(), set()),
        ({("uav1", "uav2")}, set()),
        ({("uav1", "uav2")}, set()),
        (set(), set()),
        (set(), {("gateway", "uav1")}),
        (parted, set()),
        (set(), set()),
    ]


def test_a_process_is_thawed_when_the_last_freeze_of_it_ends(make_plan):
    plan, sent = make_plan(), []
    spans = ((1.0, "uav1", 0.4), (1.1, "uav1", 0.1), (1.1, "uav2", 0.9), (1.3, "uav1", 0.3))
    faults = read(plan, *({"at": at, "kind": "freeze", "process": who, "duration": t} for at, who, t in spans))
    children = SimpleNamespace(signal=lambda who, number: sent.append((tenths, who, number.name)))
    injector = FaultInjector(faults, Host(plan, None, "local", None, None), children, None)
    for tenths in range(10, 21):
        injector.step(tenths * 10**8)
    assert [one for one in sent if one[2] == "SIGCONT"] == [(16, "uav1", "SIGCONT"), (20, "uav2", "SIGCONT")]


def test_a_restarted_process_is_killed_and_starts_again_when_it_has_ended(make_plan):
    plan, sent, running = make_plan(), [], {"uav1"}
    children = SimpleNamespace(
        kill=lambda who: sent.append(("kill", who)),
        start=lambda who: sent.append(("start", who)),
        runs=running.__contains__,
    )
    faults = read(plan, {"at": 1.0, "kind": "restart", "process": "uav1"})
    injector = FaultInjector(faults, Host(plan, None, "local", None, None), children, None)
    injector.step(10**9)
    injector.step(2 * 10**9)
    assert sent == [("kill", "uav1")]
    running.clear()
    injector.step(3 * 10**9)
    injector.step(4 * 10**9)
    assert sent == [("kill", "uav1"), ("start", "uav1")]
