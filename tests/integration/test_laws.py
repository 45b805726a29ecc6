"""Each law of laws/ with five real drones or more: all checks pass, and no agent gets more than its law declares."""

from __future__ import annotations

import json
import shutil
import signal
import time
from math import hypot
from pathlib import Path

import pytest
import tomli_w
from fleet import CONTROL_RATE, PATIENCE, flockwire
from flockwire_core.loading import load_swarm
from flockwire_core.swarm.model import uav
from flockwire_core.wire.codec import decode
from flockwire_core.wire.information import relays
from flockwire_core.wire.keys import Key
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.sighting import Sighting
from flockwire_laws.aggregative import RESTARTED
from law_swarms import EXAMPLES, NAMES, of_five
from ports import free_ports

pytestmark = pytest.mark.long
OWN = {"pose", "nearby", "telemetry", "mission", "stop", "leads", "seen"}  # for its pilot; what it sees
TELLOS = ("consensus", "rigid", "containment")


def some(names, *in_all_runs):
    """Return parameters: in all runs a few that sense and send differently, the others in campaigns."""
    return [pytest.param(name, marks=() if name in in_all_runs else pytest.mark.campaign) for name in names]


@pytest.fixture
def write(tmp_path: Path):
    """Return a function that writes the swarm file of a law, on free ports."""

    def make(name: str, airframe: str = "kinematics") -> Path:
        table = of_five(name)
        table["network"] = {"base_port": free_ports()}
        table["checks"] = {**table.get("checks", {}), "control_rate": CONTROL_RATE}
        for drone in table["drones"]:
            drone["airframe"] = airframe
        for file in EXAMPLES.glob(f"{name}_*.csv"):
            shutil.copy(file, tmp_path)
        path = tmp_path / f"{name}.toml"
        path.write_text(tomli_w.dumps(table))
        return path

    return make


def fly(swarm: Path, out: Path) -> dict:
    """Fly for 30 s; return the summary of a flight that passed."""
    process = flockwire("up", swarm, "--headless", "--duration", "30", "--out", out)
    output, errors = process.communicate(timeout=3 * PATIENCE)
    assert process.returncode == 0, output + errors
    return json.loads((out / "summary.json").read_text())


@pytest.mark.parametrize("name", some(NAMES, "dmpc", "event_triggered"))
def test_five_drones_fly_the_law(name, write, tmp_path):
    swarm = write(name)
    plan = Plan(load_swarm(swarm))
    sent = ("estimate", "pose", "status") if relays(plan.swarm) else ("law",)  # of the leader, pose and status
    for i in plan.swarm.followers:
        sources = {name for j in plan.swarm.topology.neighbours(i) for name in (uav(j), plan.pilots[j])}
        for key in plan.subscribes[uav(i)]:
            own = key.kind in OWN and (key.owner in ("", uav(i), "gateway") or key.kind == "leads")
            assert own or (key.kind in sent and key.owner in sources), key
            assert key.kind != "pose" or key.owner in (uav(i), *map(uav, plan.swarm.leaders)), key
    assert all(check["ok"] for check in fly(swarm, tmp_path / "out")["checks"])


@pytest.mark.parametrize("name", some(TELLOS, "containment"))
def test_five_tellos_fly_the_law(name, write, tmp_path):
    assert all(check["ok"] for check in fly(write(name, "tello"), tmp_path / "out")["checks"])


@pytest.mark.parametrize("name", some(NAMES, "bearing"))
def test_the_probe_finds_no_leak_with_the_keys_of_the_law(name, write, tmp_path):
    process = flockwire("probe", write(name), "--out", tmp_path / "probe")
    output, errors = process.communicate(timeout=10 * PATIENCE)
    assert process.returncode == 0, output + errors
    results = json.loads((tmp_path / "probe/probe.json").read_text())
    assert results["leaks"] == results["blocked"] == []


def test_an_insider_of_a_bearing_law_gets_bearings_and_no_pose_of_a_neighbour(write, make_fleet, make_tower):
    fleet, received = make_fleet(write("bearing")), {}
    fleet.start()
    tower = make_tower(fleet)
    tower.all_in("ready", *map(uav, fleet.plan.swarm.followers))
    with fleet.insider("uav2") as session:
        held = [
            session.declare_subscriber(text, lambda one: received.update({str(one.key_expr): one.payload.to_bytes()}))
            for text in ("**", *map(fleet.plan.text, fleet.plan.keys))
        ]
        time.sleep(3.0)
        del held
    allowed = {fleet.plan.text(key): key for key in fleet.plan.subscribes["uav2"]}
    assert received.keys() <= allowed.keys()
    assert {allowed[text].owner for text in received if allowed[text].kind in ("pose", "seen", "nearby")} == {"uav2"}
    sighting = decode(Sighting, received[fleet.plan.text(Key("seen", "uav2"))])
    assert {one.number for one in sighting.neighbours} == {1, 3}
    for one in sighting.neighbours:
        assert hypot(*one.bearing) == pytest.approx(1.0)
        assert (one.distance, one.position, one.velocity) == (None, None, None)


def test_an_agent_killed_in_its_rounds_is_named_by_its_neighbours_and_all_land(write, make_fleet, make_tower):
    swarm = write("aggregative")  # a landing that its driver began is final: the restart must be faster
    swarm.write_text(swarm.read_text() + "\n[limits.staleness]\ncommand_land = 20.0\nestimates_land = 20.0\n")
    fleet = make_fleet(swarm)
    names = [uav(i) for i in fleet.plan.swarm.followers]
    fleet.start()
    tower = make_tower(fleet)
    tower.all_in("ready", *names)
    tower.wait(lambda seen: "gateway" in seen)
    tower.order("takeoff")
    tower.all_in("hold", *names)
    tower.order("start")
    tower.all_in("formation", *names)
    time.sleep(3.0)  # some rounds
    fleet.end("uav2", signal.SIGKILL)
    fleet.start("uav2")
    named = RESTARTED.format(2)
    tower.wait(lambda seen: all(named in seen[j].report.line for j in ("uav1", "uav3") if j in seen) and "uav1" in seen)
    tower.order("land")
    tower.wait(lambda seen: all(seen[name].report.phase in ("ready", "grounded") for name in names if name in seen))
