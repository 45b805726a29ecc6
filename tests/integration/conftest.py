"""Real processes on real Zenoh: every one that a test starts ends with it, also when the test fails."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import psutil
import pytest
from fleet import Fleet, Tower, copy_swarm, processes_of


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark all tests of this folder."""
    for item in items:
        if Path(__file__).parent in item.path.parents:
            item.add_marker(pytest.mark.integration)


@pytest.fixture
def make_swarm(tmp_path: Path) -> Callable[..., Path]:
    """Return a function that copies a shipped swarm file to free ports; keywords replace lines `key = value`."""
    return partial(copy_swarm, tmp_path)


@pytest.fixture
def make_fleet(tmp_path: Path) -> Iterator[Callable[[Path], Fleet]]:
    """Return a function that makes a Fleet; its processes end with the test."""
    fleets: list[Fleet] = []

    def make(swarm_file: Path) -> Fleet:
        fleets.append(Fleet(swarm_file, tmp_path / f"fleet{len(fleets)}"))
        return fleets[-1]

    yield make
    for fleet in fleets:
        fleet.end_all()


@pytest.fixture
def make_tower() -> Iterator[Callable[[Fleet], Tower]]:
    """Return a function that makes a Tower; its session ends with the test."""
    towers: list[Tower] = []

    def make(fleet: Fleet) -> Tower:
        towers.append(Tower(fleet.plan, fleet.keys))
        return towers[-1]

    yield make
    for tower in towers:
        tower.close()


@pytest.fixture
def in_flight(
    make_swarm: Callable[..., Path], make_fleet: Callable[[Path], Fleet], make_tower: Callable[[Fleet], Tower]
) -> Callable[..., tuple[Fleet, Tower]]:
    """Return a function that flies the paper's swarm, all in formation; keywords as for `make_swarm`."""

    def fly(**replaced: str) -> tuple[Fleet, Tower]:
        fleet = make_fleet(make_swarm(**replaced))
        tower = make_tower(fleet)
        fleet.start()
        tower.fly()
        return fleet, tower

    return fly


@pytest.fixture(autouse=True)
def nothing_left(tmp_path: Path) -> Iterator[None]:
    """Check that no test leaves a process behind; end those that it did."""
    yield
    left = [process for file in tmp_path.glob("*.toml") for process in processes_of(file)]
    names = [" ".join(process.cmdline()) for process in left if process.is_running()]
    for process in left:
        with contextlib.suppress(psutil.Error):
            process.kill()
    assert not names
