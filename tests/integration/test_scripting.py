"""Ctrl-C in a flight by script: what flies lands, and nothing is left."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from fleet import PATIENCE, processes_of
from flockwire_analysis.reading import read_trace
from waiting import wait_until

SCRIPT = """
import asyncio, sys
from flockwire_operator.scripting import open_swarm

async def fly():
    async with open_swarm(sys.argv[1], out=sys.argv[2]) as flight:
        await flight.start()
        print("flies", flush=True)
        await flight.sleep(300.0)

asyncio.run(fly())
"""


def script(swarm: Path, out: Path) -> subprocess.Popen[str]:
    """Start the script."""
    line = [sys.executable, "-c", SCRIPT, str(swarm), str(out)]
    return subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def interrupted(process: subprocess.Popen[str], swarm: Path) -> None:
    """Assert that a script ends by the interrupt that it gets, and its swarm with it."""
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=PATIENCE / 2)  # less than an order may take that nobody obeys
    assert process.returncode == -signal.SIGINT, errors
    assert errors.strip().endswith("KeyboardInterrupt")
    assert "FlightError" not in errors
    assert not processes_of(swarm)


@pytest.mark.long
def test_an_interrupt_in_flight_lands_the_drones(make_swarm: Callable[..., Path], tmp_path: Path) -> None:
    swarm, out = make_swarm(), tmp_path / "out"
    process = script(swarm, out)
    assert process.stdout.readline() == "flies\n"
    interrupted(process, swarm)
    trace = read_trace(out / "trace.mcap")
    assert trace.closed
    assert [mission.verb for mission in trace.missions][-1] == "land"
    assert (out / "report.html").exists()


def test_an_interrupt_while_it_starts_ends_what_was_started(make_swarm: Callable[..., Path], tmp_path: Path) -> None:
    swarm, out = make_swarm(), tmp_path / "out"
    process = script(swarm, out)
    wait_until((out / "logs" / "recorder.log").exists, PATIENCE)
    interrupted(process, swarm)
    assert not (out / "report.html").exists()
