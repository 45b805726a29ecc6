"""Five multirotors in real processes, all simulated by one."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from fleet import flockwire


@pytest.mark.long
@pytest.mark.alone  # a pause of 0.3 s is 0.1 m: 0.148 m in 1 of some 60 flights beside other tests, alone 0 of 4
@pytest.mark.parametrize("rotors", ["false", "true"])
def test_five_fly_in_formation(make_swarm: Callable[..., Path], tmp_path: Path, rotors: str) -> None:
    swarm, out = make_swarm(), tmp_path / "out"
    text = swarm.read_text().replace("[[drones]]", '[[drones]]\nairframe = "multirotor"')
    text = text.replace('law = "paper"', 'law = "extended"').replace("[avoidance]", "[avoidance]\nsensing_radius = 3.0")
    swarm.write_text(f"{text}\n[airframes.multirotor]\nrotors = {rotors}\n")
    output, errors = flockwire("up", swarm, "--headless", "--duration", "12", "--out", out).communicate(timeout=120)
    summary = json.loads((out / "summary.json").read_text())
    assert summary["formation_error_m"]["max_tail"] < 0.040, errors + output
    assert summary["formation_error_m"]["settled_s"] < 8.0
