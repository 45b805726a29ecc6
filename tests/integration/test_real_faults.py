"""Real flights in which `flockwire up` kills or freezes a process: nobody collides, and all come down."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from fleet import flockwire, processes_of
from flockwire_analysis.reading import read_trace

pytestmark = [pytest.mark.integration, pytest.mark.long]
ON_GROUND = 0.15  # m
DISTURBED = (
    ("leader", "kill"),
    ("gateway", "kill"),
    ("kinematics", "kill"),
    ("uav2", "freeze 8"),
    ("gateway", "freeze 2"),
)


@pytest.mark.parametrize(("process", "fault"), DISTURBED)
def test_a_disturbed_process_harms_no_drone(
    make_swarm: Callable[..., Path], tmp_path: Path, process: str, fault: str
) -> None:
    kind, _, lasts = fault.partition(" ")
    swarm, out, faults = make_swarm(), tmp_path / "out", tmp_path / "one.faults"
    duration = f"duration = {lasts}.0\n" if lasts else ""
    faults.write_text(f'[[faults]]\nat = 5.0\nkind = "{kind}"\nprocess = "{process}"\n{duration}')
    run = flockwire("up", swarm, "--headless", "--duration", "9", "--out", out, "--faults", faults)
    output, errors = run.communicate(timeout=180)
    checks = {check["name"]: check["ok"] for check in json.loads((out / "summary.json").read_text())["checks"]}
    assert checks["separation"], output + errors
    trace = read_trace(out / "trace.mcap")
    heights = [trace.positions(number).values[-1, 2] for number in trace.flying]
    assert max(heights) < ON_GROUND or (process, kind) == ("kinematics", "kill"), output + errors
    assert not processes_of(swarm)
