"""A new kind of process is a row in each of the two tables and a folder with its core: here a weather station.

The rows and the folder are added to a copy of the sources; nothing else is touched.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import pytest
from fleet import keys_of
from flockwire.wire.status import Status
from mcap.reader import make_reader

ROOT = Path(__file__).parents[2]
PROCESS_ROW = """
WEATHER = Process("weather", "Run the weather station.", _one("weather"), "flockwire_weather.core:make_core", port=9)

PROCESSES = (WEATHER, """
KEY_ROW = """
TABLE = (
    KeyRow("wind", Command, lambda _: (Owner("weather"),), _all(WEATHER), _all(AGENT), 40, 512, maximum_age=3.0),
"""
CORE = '''
"""A weather station without clock, input or output."""

from flockwire.flight.cores import Ground
from flockwire.wire.keys import Key
from flockwire.wire.messages import Command
from flockwire.wire.status import Report


class WeatherCore(Ground):
    period = 1.0

    def __init__(self, frame):
        super().__init__()
        self._frame = frame

    def receive(self, key, message, now):
        raise AssertionError(key)

    def step(self, now):
        return [(Key("wind", "weather"), Command(now, self._frame, (1.0, 2.0, 0.0)))]

    def report(self, now):
        return Report("measuring")


def make_core(start):
    return WeatherCore(start.plan.swarm.frame)
'''


@pytest.fixture
def environment(tmp_path: Path) -> dict[str, str]:
    """Return the environment in which `flockwire` is that of the copy with the weather station."""
    packages = [path for path in ROOT.glob("*/flockwire*") if path.is_dir()]
    for package in packages:
        shutil.copytree(package, tmp_path / "tree" / package.relative_to(ROOT))
    wire = tmp_path / "tree/core/flockwire/wire"
    for name, old, new in (
        ("processes.py", "\nPROCESSES = (", PROCESS_ROW),
        ("keys.py", "\nTABLE = (\n", KEY_ROW),
        ("keys.py", "\nTIME_REQUEST = ", "\nfrom flockwire.wire.processes import WEATHER\n\nTIME_REQUEST = "),
    ):
        text = (wire / name).read_text()
        assert text.count(old) == 1, (name, old)
        (wire / name).write_text(text.replace(old, new))
    folder = tmp_path / "tree/weather/flockwire_weather"
    folder.mkdir(parents=True)
    (folder / "__init__.py").touch()
    (folder / "core.py").write_text(CORE)
    roots = sorted({str(path.parent) for path in (tmp_path / "tree").glob("*/flockwire*")})
    return {**os.environ, "PYTHONPATH": os.pathsep.join(roots)}


def counted(trace: Path) -> tuple[Counter[str], dict[str, Status]]:
    """Return how many messages of each topic a trace has, and the last status of each process."""
    counts: Counter[str] = Counter()
    statuses: dict[str, Status] = {}
    with trace.open("rb") as stream:
        for _, channel, message in make_reader(stream).iter_messages():
            counts[channel.topic] += 1
            if channel.topic.endswith("/status"):
                status = Status.decode(message.data)
                statuses[status.identity] = status
    return counts, statuses


@pytest.mark.long
def test_a_row_and_a_core_make_a_new_kind_of_process(
    make_swarm: Callable[..., Path], tmp_path: Path, environment: dict[str, str]
) -> None:
    swarm, keys = make_swarm(), tmp_path / "keys-paper"

    def flockwire(*arguments: object, judged: bool = True) -> str:
        line = [sys.executable, "-m", "flockwire_cli", *map(str, arguments)]
        done = subprocess.run(line, capture_output=True, text=True, timeout=120, env=environment, check=False)
        assert done.returncode in ((0,) if judged else (0, 1)), done.stdout + done.stderr
        assert "Traceback" not in done.stderr
        return done.stdout

    assert keys == keys_of(swarm)
    (listed,) = [line for line in flockwire("check", swarm).splitlines() if line.startswith("  weather ")]
    assert listed.split(maxsplit=2)[2] == "uav1, uav2, uav3, uav4, recorder, operator, console"
    flockwire("up", swarm, "--headless", "--duration", 5, "--out", tmp_path / "real", "--keys", keys, judged=False)
    assert (keys / "weather.crt").exists()
    flockwire("sim", swarm, "--duration", 5, "--out", tmp_path / "virtual", judged=False)  # short: may not settle
    assert "Traceback" not in (tmp_path / "real/logs/weather.log").read_text()
    for world in ("real", "virtual"):
        counts, statuses = counted(tmp_path / world / "trace.mcap")
        assert 5 <= counts["/paper/weather/wind"] <= 40, world
        assert statuses["weather"].report.phase == "measuring", world
    _, statuses = counted(tmp_path / "real/trace.mcap")
    for agent in ("uav1", "uav2", "uav3", "uav4"):
        assert "weather" in statuses[agent].links
        assert not [reason for reason, _ in statuses[agent].rejected if "wind" in reason]
    assert "Run the weather station." in flockwire("--help")
