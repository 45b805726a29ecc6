"""The first flights of bench/fault_flights.py: faults of every kind, drawn by seed, harm nobody."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest

BENCH = Path(__file__).parents[2] / "bench" / "fault_flights.py"
FLIGHTS = 10


@pytest.fixture(scope="module")
def bench() -> ModuleType:
    spec = importlib.util.spec_from_file_location("fault_flights", BENCH)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["fault_flights"] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def flown(bench: ModuleType) -> list:
    return [bench.fly(seed) for seed in range(FLIGHTS)]


def test_nobody_collides_and_all_are_down_at_the_end(flown: list) -> None:
    assert [(result.seed, result.bad) for result in flown if result.bad] == []


def test_they_reach_rungs_of_drivers_and_of_pilots(bench: ModuleType, flown: list) -> None:
    reached = {rung for result in flown for rung in result.rungs}
    assert reached <= set(bench.RUNGS)
    assert {"own pose: zero", "own pose: land", "neighbour: dropped", "driver: zero", "driver: land"} <= reached


def test_a_seed_draws_the_same_flight_again(bench: ModuleType, flown: list) -> None:
    assert bench.fly(7) == flown[7]


def test_every_kind_of_fault_is_drawn(bench: ModuleType) -> None:
    kinds = {fault["kind"] for seed in range(80) for fault in bench.drawn(seed).faults}
    assert kinds == set(bench.KINDS)


def test_a_collision_would_be_seen(bench: ModuleType, flown: list, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bench, "COLLISION", 5.0)
    seed = next(result.seed for result in flown if result.closest < 1.0)
    assert any("collision of uav" in what for what in bench.fly(seed).bad)


def test_a_hard_touch_down_would_be_seen(bench: ModuleType, flown: list, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bench, "HARD", -0.5)
    seed = next(result.seed for result in flown if result.fastest_contact > 0.6)
    assert any("touched down at 0." in what for what in bench.fly(seed).bad)


@pytest.mark.parametrize(
    "seed",
    [
        pytest.param(1464, id="drivers that stood still while told to end"),
        pytest.param(2301, id="a landing into the hollow between two on the ground and the fence"),
        pytest.param(4087, id="an agent restarted in flight that does not hear its driver"),
        pytest.param(1767, id="a stop after the drivers' clock was set back"),
    ],
)
def test_what_went_wrong_once(bench: ModuleType, seed: int) -> None:
    assert bench.fly(seed).bad == []
