"""The wire itself: who is linked, what a replay does, what the probe finds when a rule is wrong."""

from __future__ import annotations

import json
import random
import signal
import subprocess
import sys
import textwrap
import time
from collections import Counter
from collections.abc import Callable, Collection
from pathlib import Path

import zenoh
from fleet import Fleet, Tower, flockwire, free_ports
from flockwire.wire.keys import MISSION

MakeSwarm = Callable[..., Path]
MakeFleet = Callable[[Path], Fleet]
MakeTower = Callable[[Fleet], Tower]
InFlight = Callable[..., tuple[Fleet, Tower]]

PATCHED = """
import sys
from flockwire.runtime import session
right = session.access_control

def wrong(plan, identity):
    rules = right(plan, identity)
    if identity == {identity!r}:
        for rule in rules["rules"]:
            if rule["id"] == {rule!r}:
                {change}
    return rules

session.access_control = wrong
sys.argv[0] = "flockwire"
from flockwire_cli.entry import main
main()
"""


def start_patched(fleet: Fleet, identity: str, rule: str, change: str, *arguments: str) -> None:
    """Start the process of `identity` with one of its rules changed."""
    script = fleet.out / f"patched_{identity}.py"
    script.write_text(PATCHED.format(identity=identity, rule=rule, change=textwrap.dedent(change)))
    with (fleet.out / f"{identity}.log").open("ab") as log:
        line = [sys.executable, str(script), *arguments, "--keys", str(fleet.keys)]
        fleet.running[identity] = subprocess.Popen(line, stderr=log, stdout=log)


def probe(fleet: Fleet, out: Path) -> tuple[int, dict, str]:
    """Run the probe against a swarm that runs; returns its exit status, probe.json and what it printed."""
    process = flockwire("probe", fleet.swarm_file, "--out", str(out))
    output, errors = process.communicate(timeout=280)
    return process.returncode, json.loads((out / "probe.json").read_text()), output + errors


def test_every_process_is_linked_to_whom_it_must_hear_and_nobody_else(
    make_swarm: MakeSwarm, make_fleet: MakeFleet, make_tower: MakeTower
) -> None:
    fleet = make_fleet(make_swarm())
    tower = make_tower(fleet)
    fleet.start()
    tower.all_in("ready")
    wanted = {name: sorted(fleet.plan.partners[name]) for name in fleet.running}
    tower.wait(lambda seen: all(name in seen and len(seen[name].links) >= len(wanted[name]) for name in wanted))
    time.sleep(1)
    seen = tower.wait(lambda seen: len(seen) == len(wanted))
    assert {name: sorted(status.links) for name, status in seen.items()} == wanted


SMALL = """
name = "small"
control = {{ law = "paper" }}
formation = {{ kind = "circle" }}
graph = {{ edges = [[0, 1], [1, 2]] }}
drones = [{{ id = 0, start = [0, 0, 0] }}, {{ id = 1, start = [0, 2, 0] }}, {{ id = 2, start = [0, -2, 0] }}]
network = {{ mode = "{mode}", base_port = {port} }}
"""


def small_swarm(folder: Path, mode: str) -> Path:
    """Write a swarm of two followers, small enough for a quick probe."""
    path = folder / "small.toml"
    path.write_text(SMALL.format(mode=mode, port=free_ports()))
    return path


def test_the_probe_names_a_rule_that_was_widened_and_one_that_was_removed(
    make_fleet: MakeFleet, make_tower: MakeTower, tmp_path: Path
) -> None:
    fleet = make_fleet(small_swarm(tmp_path, "peers"))
    widen = 'rule["key_exprs"] = rule["key_exprs"] + ["small/uav2/pose"]'
    both = f'{widen}\n            if rule["id"] == "uav1 is asked":\n                {widen}'
    file = str(fleet.swarm_file)
    start_patched(fleet, "gateway", "uav1 publishes", both, "gateway", file)
    start_patched(fleet, "uav2", "uav1 receives", 'rule["permission"] = "deny"', "agent", file, "2")
    fleet.start("recorder", "kinematics", "leader", "uav1")
    tower = make_tower(fleet)
    tower.all_in("ready", "leader", "uav1")
    tower.close()
    status, results, printed = probe(fleet, tmp_path / "probe")
    assert status == 1
    modes = ("peer", "client", "router")
    assert results["leaks"] == [f"leak: uav1 as {mode} heard small/uav2/pose; it must not" for mode in modes]
    assert results["blocked"] == [
        f"blocked: uav1 as {mode} may have small/uav1/estimate said by uav2; it did not get through" for mode in modes
    ]
    assert results["leaks"][0] in printed


def test_router_mode_keeps_to_the_same_graph(tmp_path: Path) -> None:
    swarm = small_swarm(tmp_path, "router")
    process = flockwire("probe", swarm, "--out", str(tmp_path / "probe"))
    output, errors = process.communicate(timeout=280)
    assert process.returncode == 0, output + errors
    results = json.loads((tmp_path / "probe" / "probe.json").read_text())
    assert results["leaks"] == results["blocked"] == []
    assert len(results["attackers"]) == 3 * (3 + 8)


def test_the_router_dies_and_returns_and_the_flight_resumes(
    make_swarm: MakeSwarm, make_fleet: MakeFleet, make_tower: MakeTower
) -> None:
    swarm = make_swarm(takeoff_height="2.5")
    text = swarm.read_text().replace("[network]", '[network]\nmode = "router"')
    ladder = "pose_land = 8.0\nestimates_land = 9.0\ncommand_land = 8.0\ntelemetry_land = 9.0"
    swarm.write_text(f"{text}\n[limits.staleness]\n{ladder}\n")
    fleet = make_fleet(swarm)
    fleet.start("router")
    tower = make_tower(fleet)
    fleet.start(*(name for name in ("recorder", "gateway", "kinematics", "leader", "uav1", "uav2", "uav3", "uav4")))
    tower.fly()
    tower.settled(0.05)
    fleet.end("router", signal.SIGKILL)
    time.sleep(0.7)
    fleet.start("router")
    tower.settled(0.05, 30)
    for i in range(1, 5):
        assert "hold" in fleet.log(f"uav{i}").split("formation", 1)[1]


def test_a_recorded_flight_played_back_by_an_insider_moves_nobody(in_flight: InFlight) -> None:
    fleet, tower = in_flight()
    recorded: list[tuple[str, bytes, bytes]] = []

    def record(sample: zenoh.Sample) -> None:
        recorded.append((str(sample.key_expr), sample.payload.to_bytes(), sample.attachment.to_bytes()))

    overhear(fleet, record, 4.0)
    tower.settled(0.03)
    sent: Counter[str] = Counter()
    worst = 0.0
    for insider in ("gateway", "kinematics", "uav1", "uav2"):
        said = {fleet.plan.text(key) for key in fleet.plan.publishes[insider]}
        with fleet.insider(insider) as session:
            for place, (key, payload, attached) in enumerate(row for row in recorded if row[0] in said):
                session.put(key, payload, attachment=attached, congestion_control=zenoh.CongestionControl.BLOCK)
                sent[key] += 1
                if place % 10 == 0:
                    time.sleep(0.005)
                if place % 50 == 0:
                    seen = tower.wait(lambda seen: all(f"uav{i}" in seen for i in range(1, 5)))
                    worst = max(worst, *(seen[f"uav{i}"].report.formation_error for i in range(1, 5)))
    assert worst < 0.03
    time.sleep(0.5)
    seen = tower.wait(lambda seen: len(seen) == 8)
    turned_away = {reader: _turned_away(seen[reader[0]], reader[1]) for reader in readers(fleet, sent)}
    assert len(turned_away) > 20
    assert turned_away == {reader: sent[reader[1]] for reader in turned_away}
    assert min(turned_away.values()) > 30


def overhear(fleet: Fleet, take: Callable[[zenoh.Sample], object], seconds: float) -> None:
    """Listen as the recorder for a while."""
    with fleet.insider("recorder") as session:
        for key in fleet.plan.subscribes["recorder"]:
            session.declare_subscriber(fleet.plan.text(key), zenoh.handlers.Callback(take, indirect=False))
        time.sleep(seconds)


def readers(fleet: Fleet, said: Collection[str]) -> list[tuple[str, str]]:
    """Return every process with each key of those `said` that it hears and counts for itself.

    That is not the recorder, which takes everything; nor any with the mission, which the gateway repeats unchanged.
    """
    names = [name for name in fleet.running if name != "recorder"]
    keys = [(name, key) for name in names for key in fleet.plan.subscribes[name] if key != MISSION]
    return [(name, text) for name, key in keys if (text := fleet.plan.text(key)) in said]


def _turned_away(status: object, key: str) -> int:
    return sum(count for name, count in status.rejected if name.startswith(f"{key} "))


def test_a_hundred_thousand_payloads_end_no_process_and_delay_no_step(in_flight: InFlight) -> None:
    fleet, tower = in_flight()
    tower.settled(0.05)
    genuine: dict[str, bytes] = {}
    overhear(fleet, lambda sample: genuine.setdefault(str(sample.key_expr), sample.payload.to_bytes()), 1.0)
    assert len(genuine) > 30
    before = tower.all_in("formation")
    dice, sent = random.Random(7), Counter()
    for insider in ("gateway", "kinematics", "leader", "uav1", "uav2", "uav3", "uav4", "operator"):
        keys = [fleet.plan.text(key) for key in fleet.plan.publishes[insider]]
        with fleet.insider(insider) as session:
            for k in range(100_000 // 8):
                key = keys[k % len(keys)]
                payload = bytearray(genuine.get(key, b"")) if k % 2 else bytearray(dice.randbytes(dice.randrange(200)))
                if payload:
                    payload[dice.randrange(len(payload))] ^= 1 << dice.randrange(8)
                session.put(key, bytes(payload), attachment=dice.randbytes(33))
                sent[key] += 1
                if k % 20 == 19:
                    time.sleep(0.004)
    assert sent.total() >= 99_000
    after = tower.all_in("formation")
    wanted = {reader: sent[reader[1]] for reader in readers(fleet, sent)}
    assert len(wanted) > 30
    tower.wait(lambda seen: {reader: _turned_away(seen[reader[0]], reader[1]) for reader in wanted} == wanted)
    assert all(after[name].steps > before[name].steps for name in before)
    assert all(process.poll() is None for process in fleet.running.values())
    tower.settled(0.05)
