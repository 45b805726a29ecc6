"""What the probe finds when a rule is wrong, and a router that dies."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import textwrap
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from fleet import Fleet, Tower, flockwire
from ports import free_ports

MakeSwarm = Callable[..., Path]
MakeFleet = Callable[[Path], Fleet]
MakeTower = Callable[[Fleet], Tower]
InFlight = Callable[..., tuple[Fleet, Tower]]

PATCHED = """
import sys
from flockwire_core.runtime import configuration
right = configuration.access_control

def wrong(plan, identity):
    rules = right(plan, identity)
    if identity == {identity!r}:
        for rule in rules["rules"]:
            if rule["id"] == {rule!r}:
                {change}
    return rules

configuration.access_control = wrong
sys.argv[0] = "flockwire"
from flockwire_operator.cli.entry import main
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


SMALL = """
name = "small"
control = {{ law = "paper" }}
formation = {{ kind = "circle" }}
graph = {{ edges = [[0, 1], [1, 2]] }}
drones = [{{ id = 0, start = [0, 0, 0] }}, {{ id = 1, start = [0, 2, 0] }}, {{ id = 2, start = [0, -2, 0] }}]
network = {{ mode = "{mode}", link = "{link}", base_port = {port} }}
"""


def small_swarm(folder: Path, mode: str, link: str = "tls") -> Path:
    """Write a swarm of two followers, small enough for a quick probe."""
    path = folder / "small.toml"
    path.write_text(SMALL.format(mode=mode, link=link, port=free_ports()))
    return path


@pytest.mark.long
def test_the_probe_names_a_rule_that_was_widened_and_one_that_was_removed(
    make_fleet: MakeFleet, make_tower: MakeTower, tmp_path: Path
) -> None:
    fleet = make_fleet(small_swarm(tmp_path, "peers"))
    widen = 'rule["key_exprs"] = rule["key_exprs"] + ["small/uav2/pose"]'
    both = f'{widen}\n            if rule["id"] == "uav1 accepts subscriptions":\n                {widen}'
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
    assert results["leaks"] == [f"leak: uav1 as {mode} received small/uav2/pose; it must not" for mode in modes]
    assert results["blocked"] == [
        f"blocked: uav1 as {mode} may publish small/uav1/estimate; uav2 did not accept it" for mode in modes
    ]
    assert results["leaks"][0] in printed


@pytest.mark.long
@pytest.mark.parametrize(("mode", "link"), [("router", "tls"), ("peers", "quic")])
def test_the_probe_finds_the_same_graph_on_every_kind_of_network(tmp_path: Path, mode: str, link: str) -> None:
    swarm = small_swarm(tmp_path, mode, link)
    process = flockwire("probe", swarm, "--out", str(tmp_path / "probe"))
    output, errors = process.communicate(timeout=280)
    assert process.returncode == 0, output + errors
    results = json.loads((tmp_path / "probe" / "probe.json").read_text())
    assert results["leaks"] == results["blocked"] == []
    assert len(results["attackers"]) == (3 * (3 + 9) if mode == "router" else 3 * (3 + 8))


@pytest.mark.long
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
