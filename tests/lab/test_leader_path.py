"""The leader's path through two obstacles and a crossing follower: the first flights of lab/bench/leader_path.py."""

from __future__ import annotations

import importlib.util
import sys
from math import inf
from pathlib import Path
from types import ModuleType

import pytest

BENCH = Path(__file__).parents[2] / "lab/bench" / "leader_path.py"


@pytest.fixture(scope="module")
def bench() -> ModuleType:
    spec = importlib.util.spec_from_file_location("leader_path", BENCH)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["leader_path"] = module
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("number", range(10))
def test_the_leader_keeps_clear_and_reaches_its_end(bench: ModuleType, number: int) -> None:
    run = bench.fly(number)
    assert run.failure == ""
    assert run.arrived < 60.0
    assert run.drones >= 0.4
    assert run.obstacle >= 0.3


@pytest.mark.parametrize("number", range(2))
def test_with_a_tellos_lag_and_noise_too(bench: ModuleType, number: int) -> None:
    run = bench.fly(number, bench.TELLO)
    assert bench.good(run, bench.drawn(number))


def test_without_the_safety_filter_it_flies_through_them(bench: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bench, "LONGEST", 30.0)
    run = bench.fly(0, {"control": {"safety_filter": False}})
    assert run.leader_obstacle < 0.3
    assert run.arrived < inf
