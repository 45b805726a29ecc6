"""A new kind of process is a row in each of the two tables and a folder with its core: here a weather station.

The rows and the folder are added to a copy of the sources; nothing else is touched.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from pathlib import Path

import pytest
from extended_sources import ExtendedSources
from fleet import keys_of
from flockwire_core.wire.codec import decode
from flockwire_core.wire.status import Status
from mcap.reader import make_reader

PROCESS_ROW = """
WEATHER = Process("weather", "Run the weather station.", _one("weather"), "flockwire_weather.core:make_core", port=9)

PROCESSES = (WEATHER, """
KEY_ROW = """
TABLE = (
    KeyRow("wind", Command, lambda _: (Member("weather"),), _all(WEATHER), _all(AGENT), 40, 512, maximum_age=3.0),
"""
CORE = '''
"""A weather station without clock, input or output."""

from flockwire_core.process.cores import Ground
from flockwire_core.wire.keys import Key
from flockwire_core.domain.airframe import Command
from flockwire_core.wire.status import Report


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
def flockwire(tmp_path: Path) -> Callable[..., str]:
    """Return what runs `flockwire` of the copy with the weather station."""
    wire = "core/flockwire_core/wire"
    edits = (
        (f"{wire}/processes.py", "\nPROCESSES = (", PROCESS_ROW),
        (f"{wire}/keys.py", "\nTABLE = (\n", KEY_ROW),
        (
            f"{wire}/keys.py",
            "\nTIME_REQUEST = ",
            "\nfrom flockwire_core.wire.processes import WEATHER\n\nTIME_REQUEST = ",
        ),
    )
    files = {"weather/flockwire_weather/__init__.py": "", "weather/flockwire_weather/core.py": CORE}
    return ExtendedSources(tmp_path / "tree", edits, files).flockwire


def counted(trace: Path) -> tuple[Counter[str], dict[str, Status]]:
    """Return how many messages of each topic a trace has, and the last status of each process."""
    counts: Counter[str] = Counter()
    statuses: dict[str, Status] = {}
    with trace.open("rb") as stream:
        for _, channel, message in make_reader(stream).iter_messages():
            counts[channel.topic] += 1
            if channel.topic.endswith("/status"):
                status = decode(Status, message.data)
                statuses[status.identity] = status
    return counts, statuses


@pytest.mark.long
def test_a_row_and_a_core_make_a_new_kind_of_process(
    make_swarm: Callable[..., Path], tmp_path: Path, flockwire: Callable[..., str]
) -> None:
    swarm, keys = make_swarm(), tmp_path / "keys-paper"
    assert keys == keys_of(swarm)
    (listed,) = [line for line in flockwire("check", swarm).splitlines() if line.startswith("  weather ")]
    assert listed.split(maxsplit=2)[2] == "uav1, uav2, uav3, uav4, recorder, operator, console"
    flockwire("up", swarm, "--headless", "--duration", 5, "--out", tmp_path / "real", "--keys", keys, status=(0, 1))
    assert (keys / "weather.crt").exists()
    flockwire("sim", swarm, "--duration", 5, "--out", tmp_path / "virtual", status=(0, 1))  # short: may not settle
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
