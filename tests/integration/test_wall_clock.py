"""The clock of a machine is set by hours, and by more than its certificates last, while a swarm flies."""

from __future__ import annotations

import json
import shutil
import struct
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from fleet import Fleet, Tower, flockwire
from flockwire_core.security.pki import LIFE
from flockwire_core.wire.status import Status
from flockwire_operator.station.giving import UNTIMELY

pytestmark = pytest.mark.long
HOUR = 3600  # s
PILOTS = ("leader", "uav1", "uav2", "uav3", "uav4")
LOOK = 2.5  # s after a step: longer than any input may be missing before a drone lands


class WallClock:
    """The wall clock of the processes started with its environment: the test's, and a step."""

    def __init__(self, folder: Path) -> None:
        self._file, library = folder / "step", folder / "wall_clock.so"
        self.set(0)
        source = Path(__file__).with_name("wall_clock.c")
        try:
            subprocess.run(["cc", "-shared", "-fPIC", "-o", library, source, "-ldl"], check=True)
        except FileNotFoundError:
            pytest.skip("there is no C compiler")
        self.variables = {"LD_PRELOAD": str(library), "STEPPED_CLOCK": str(self._file)}

    def set(self, step: int) -> None:
        """Let the clock be `step` s ahead."""
        with self._file.open("r+b" if self._file.exists() else "wb") as file:
            file.write(struct.pack("q", step))


@pytest.fixture
def wall_clock(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> WallClock:
    """Return the wall clock of all processes that the test starts."""
    made = WallClock(tmp_path)
    for name, value in made.variables.items():
        monkeypatch.setenv(name, value)
    return made


def flies_on(tower: Tower, phase: str) -> None:
    """Check that every pilot is in `phase`, and stays there."""
    tower.all_in(phase)
    until = time.monotonic() + LOOK

    def seen(fresh: dict[str, Status]) -> bool:
        assert {name: fresh[name].report.phase for name in PILOTS} == dict.fromkeys(PILOTS, phase)
        return time.monotonic() > until

    tower.wait(seen)


def obeyed(verb: str, swarm: Path, *options: str | Path) -> None:
    """Give an order from a new terminal; check that all confirm it, and nothing else is said."""
    order = flockwire(verb, swarm, *options)
    output, errors = order.communicate(timeout=30)
    who = "uav0, uav1, uav2, uav3, uav4" if verb == "stop" else ", ".join(PILOTS)
    assert (output, errors) == (f"flockwire: {verb}: confirmed by {who}\n", "")


@pytest.mark.parametrize(("first", "second", "last"), [(5, -8, "land"), (-9, 30 * 24, "stop")])
def test_a_step_of_the_clock_by_hours_changes_no_flight_and_new_terminals_are_obeyed(
    make_swarm: Callable[..., Path],
    make_tower: Callable[[Fleet], Tower],
    wall_clock: WallClock,
    tmp_path: Path,
    first: int,
    second: int,
    last: str,
) -> None:
    swarm, out = make_swarm(), tmp_path / "out"
    flight = flockwire("up", swarm, "--headless", "--duration", "0", "--out", out)
    for line in flight.stdout:
        if "in formation" in line:
            break
    tower = make_tower(Fleet(swarm, tmp_path / "not started"))
    flies_on(tower, "formation")
    wall_clock.set(first * HOUR)
    flies_on(tower, "formation")
    obeyed("hold", swarm)
    flies_on(tower, "hold")
    wall_clock.set(second * HOUR)
    flies_on(tower, "hold")
    obeyed("start", swarm)
    tower.all_in("formation")
    obeyed(last, swarm)
    _, errors = flight.communicate(timeout=60)
    assert "ended unexpectedly" not in errors
    assert json.loads((out / "summary.json").read_text())["messages"]["rejected"] == 0


def test_services_obey_a_terminal_that_shares_no_file_with_them_and_what_is_linked_outlives_its_certificates(
    make_swarm: Callable[..., Path],
    make_fleet: Callable[[Path], Fleet],
    make_tower: Callable[[Fleet], Tower],
    wall_clock: WallClock,
    tmp_path: Path,
) -> None:
    fleet = make_fleet(make_swarm())
    fleet.start()
    tower = make_tower(fleet)
    tower.fly()
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    swarm, keys = Path(shutil.copy(fleet.swarm_file, elsewhere)), ("--keys", fleet.keys)
    wall_clock.set(5 * HOUR)
    flies_on(tower, "formation")
    obeyed("hold", swarm, *keys)
    wall_clock.set(-5 * HOUR)
    obeyed("start", swarm, *keys)
    flies_on(tower, "formation")
    wall_clock.set(2 * round(LIFE.total_seconds()))
    flies_on(tower, "formation")
    late = flockwire("land", swarm, *keys)
    _, errors = late.communicate(timeout=30)
    assert (late.returncode, UNTIMELY.partition("{who}")[2] in errors) == (1, True), errors
    flies_on(tower, "formation")
    tower.order("hold")
    flies_on(tower, "hold")
    wall_clock.set(-7 * HOUR)
    obeyed("stop", swarm, *keys)
    assert fleet.running.keys() == {name for name, process in fleet.running.items() if process.poll() is None}
