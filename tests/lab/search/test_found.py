"""Flights that a search found, shrunk; their defects are mended."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest
from flockwire_lab.search.flight import Case, fly

SWARM = Path(__file__).parents[3] / "examples/paper_simulation.toml"


@pytest.mark.long
def test_a_driver_that_restarts_just_above_the_ground_does_not_tell_that_it_is_down() -> None:
    swarm = tomllib.loads(SWARM.read_text())
    swarm |= {"graph": {"edges": [[0, 1], [1, 2]]}, "sim": {"jitter": 0.00050047527, "loss": 0.0317692418}}
    swarm["control"]["law"] = "extended"
    swarm["drones"] = [*swarm["drones"][:2], swarm["drones"][2] | {"airframe": "tello"}]
    del swarm["obstacles"]
    judged = fly(Case(swarm, [{"at": 8.0, "kind": "restart", "process": "driver2"}], 2, 4.0))
    assert judged.violations == []
