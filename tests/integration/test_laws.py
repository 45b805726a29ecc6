"""Each law of laws/ with five real drones or more: all checks pass, and no agent gets more than its law declares."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest
import tomli_w
from fleet import CONTROL_RATE, PATIENCE, flockwire, free_ports
from flockwire_core.loading import load_swarm
from flockwire_core.swarm.model import uav
from flockwire_core.wire.plan import Plan
from law_swarms import EXAMPLES, NAMES, of_five

pytestmark = pytest.mark.long
OWN = {"pose", "nearby", "telemetry", "mission", "stop", "leads", "seen"}  # for its pilot; what it sees
TELLOS = ("consensus", "rigid", "containment")


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


@pytest.mark.parametrize("name", NAMES)
def test_five_drones_fly_the_law(name, write, tmp_path):
    swarm = write(name)
    plan = Plan(load_swarm(swarm))
    for i in plan.swarm.followers:
        sources = {uav(j) for j in plan.swarm.topology.neighbours(i)}
        for key in plan.subscribes[uav(i)]:
            own = key.kind in OWN and (key.owner in ("", uav(i), "gateway") or key.kind == "leads")
            assert own or (key.kind == "law" and key.owner in sources), key
    assert all(check["ok"] for check in fly(swarm, tmp_path / "out")["checks"])


@pytest.mark.parametrize("name", TELLOS)
def test_five_tellos_fly_the_law(name, write, tmp_path):
    assert all(check["ok"] for check in fly(write(name, "tello"), tmp_path / "out")["checks"])
