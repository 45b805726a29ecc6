"""Liveness: the formation comes back after faults, by itself or after one start, and a swarm that does not is found."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from typing import Any

import pytest
from flockwire_lab.search.flight import Case, Judged, fly
from flockwire_lab.search.liveness import Recovery
from flockwire_lab.search.margin import BOUNDS

SWARM = """
name = "pair"
control = { rate_hz = 20 }
gateway = { rate_hz = 20 }
limits = { takeoff_height = 0.4 }
checks = { settle_within = 4.0 }
formation = { kind = "line", spacing = 1.0 }
graph = { edges = [[0, 1]] }
drones = [{ id = 0, start = [0.0, 0.0, 0.0] }, { id = 1, start = [1.0, 0.0, 0.0] }]
"""


def flown(*faults: dict[str, Any]) -> tuple[Judged, list[str]]:
    told: list[str] = []
    return fly(Case(tomllib.loads(SWARM), list(faults), 0, 8.0, "liveness"), told.append), told


def starts(told: list[str]) -> int:
    """How often the operator had the drones take off."""
    return sum("take-off" in line and "uav1" in line for line in told)


def test_a_short_fault_is_over_by_itself() -> None:
    judged, told = flown({"at": 3.0, "kind": "tracker", "drone": 1, "duration": 0.5})
    assert judged.violations == []
    assert starts(told) == 1
    assert judged.margins["formation"].value > 0.5
    assert judged.margins["down"].value == 1.0


@pytest.mark.parametrize("duration", [2.0, 6.0])
def test_who_landed_is_started_once_more(duration: float) -> None:
    judged, told = flown({"at": 3.0, "kind": "tracker", "drone": 1, "duration": duration})
    assert "own pose lost: land" in judged.reactions
    assert judged.violations == []
    assert starts(told) == 2


def test_a_formation_that_stays_away_is_a_violation() -> None:
    judged, _ = flown({"at": 3.0, "kind": "kill", "process": "uav1"})
    assert [violation.partition(":")[0] for violation in judged.violations] == ["formation"]


def test_a_flight_that_never_takes_off_is_a_violation(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Recovery, "_order", lambda *_: None)
    judged = fly(Case(tomllib.loads(SWARM), [], 0, 8.0, "liveness"), bounds=replace(BOUNDS, longest=10.0))
    assert [violation.partition(":")[0] for violation in judged.violations] == ["formation", "over"]
