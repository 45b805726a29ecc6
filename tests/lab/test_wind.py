"""Flights in wind: what the drones compensate, and a fault that brings one."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from math import dist
from typing import Any

import pytest

TELLO_LIKE = {
    "control": {"disturbance": 2.0},
    "airframes": {"kinematics": {"lag": 0.25, "dead_time": 0.1}},
    "gateway": {"noise": 0.001, "latency": 0.01},
}

PAIR = {  # the first rank's place is on the right, its drone starts on the left
    "formation": {"kind": "line", "spacing": 1.2},
    "graph": {"edges": [[0, 1], [1, 2]]},
    "drones": [
        {"id": 0, "start": [0.0, 0.0, 0.0]},
        {"id": 1, "start": [-1.5, 1.2, 0.0]},
        {"id": 2, "start": [1.5, 1.2, 0.0]},
    ],
}


def errors(flown: Any, begin: float, end: float) -> list[float]:
    """Return the formation errors, m, that the followers report."""
    found = [m.report.formation_error for i in (1, 2) for _, m in flown.of("status", f"uav{i}", begin, end)]
    return [error for error in found if error >= 0.0]


def test_a_gusty_wind_hardly_moves_drones_whose_gain_is_wrong(fly: Callable[..., Any]) -> None:
    wind = {"wind": {"velocity": [1.0, 0.0, 0.0], "gust": 0.5}, "airframes.kinematics.gain": 0.8}
    flown = fly(PAIR | {"formation.assignment": "free"} | TELLO_LIKE | wind, duration=9.0)
    assert flown.outcome.failure == ""
    tail = errors(flown, 7.0, 9.0)
    assert len(tail) > 20
    assert max(tail) < 0.05


def test_a_fault_brings_a_wind_for_a_time(fly: Callable[..., Any]) -> None:
    """Without compensation, a wind w holds each drone w / K off its place."""
    fault = {"at": 6.0, "kind": "wind", "velocity": [0.3, 0.0, 0.0], "duration": 2.0}
    flown = fly(PAIR | {"control": {"law": "extended", "formation_gain": 3.0}}, fault, duration=11.0)
    assert max(errors(flown, 5.5, 6.0)) < 0.01
    assert min(errors(flown, 7.8, 8.0)) == pytest.approx(0.1, abs=0.01)
    assert max(errors(flown, 10.5, 11.0)) < 0.01


def test_with_free_places_two_drones_do_not_fly_past_each_other(fly: Callable[..., Any]) -> None:
    flown = fly(PAIR | {"control.law": "extended", "formation.assignment": "free"}, duration=7.0)
    assert flown.outcome.failure == ""
    assert max(errors(flown, 6.8, 7.0)) < 0.05
    truths = [pose.position for _, pose in flown.of("truth", "uav1", 2.5, 7.0)]
    assert max(x for x, _, _ in truths) < 0.0  # its rank's place is at x = 1.2 m
    assert sum(dist(a, b) for a, b in pairwise(truths)) < 1.5  # m; 2.7 m to its rank's
