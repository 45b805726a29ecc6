"""Simulated Tellos over real UDP, each behind its own driver process."""

from __future__ import annotations

import json
import socket
from collections.abc import Callable
from pathlib import Path

import pytest
from fleet import Fleet, flockwire
from flockwire_tello.swarm_file import COMMAND_PORT, tello_addresses

pytestmark = pytest.mark.integration
KILL = """
[[faults]]
at = 11.0
kind = "kill"
process = "driver2"
"""


@pytest.mark.long
def test_five_tellos_fly_the_formation_and_a_killed_driver_is_restarted(
    make_swarm: Callable[..., Path], tmp_path: Path
) -> None:
    swarm, out, faults = make_swarm(source="paper_flight"), tmp_path / "out", tmp_path / "kill.faults"
    faults.write_text(KILL)
    process = flockwire("up", swarm, "--headless", "--duration", "24", "--out", out, "--faults", faults)
    output, errors = process.communicate(timeout=120)
    summary = json.loads((out / "summary.json").read_text())
    checks = {check["name"]: check["ok"] for check in summary["checks"]}
    assert checks["separation"], output
    assert checks["landed"], output
    assert (output + errors).count("ended unexpectedly") == 1, output
    assert "driver2 ended unexpectedly (signal SIGKILL)" in output
    phases = [line.split(": ")[1] for line in (out / "logs/driver2.log").read_text().splitlines()]
    assert phases.count("flying") >= 2, phases
    assert phases.count("taking off") == 1, phases  # the second driver found its drone in the air
    assert summary["formation_error_m"]["rms_tail"] < 0.05


def test_a_driver_whose_port_is_taken_reports_it_in_one_line(
    make_swarm: Callable[..., Path], make_fleet: Callable[[Path], Fleet]
) -> None:
    fleet = make_fleet(make_swarm(source="paper_flight"))
    addresses = tello_addresses(fleet.plan.swarm, 1)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind((addresses.local, COMMAND_PORT))
        fleet.start("driver1")
        assert fleet.running.pop("driver1").wait(20) == 2
    (line,) = fleet.log("driver1").strip().splitlines()
    assert f"cannot bind UDP {addresses.local}, port {COMMAND_PORT}: it is in use; end the other client" in line
