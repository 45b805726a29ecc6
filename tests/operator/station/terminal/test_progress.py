"""Commands that take a while show how far they are, on a terminal alone, and end in one line when interrupted."""

import asyncio
import os
import signal
import subprocess
import sys
from contextlib import redirect_stderr
from pathlib import Path

from flockwire_analysis.reading import read_trace
from flockwire_lab.flight import Flight
from flockwire_lab.probe.attackers import Attacker
from flockwire_operator.cli.flights import simulate
from flockwire_operator.station import probe
from flockwire_operator.station.operator import Operator
from flockwire_operator.station.terminal.progress import progress
from simulated_pilots import SimulatedSwarm
from terminal_text import text_until
from waiting import wait_until

SWARM = Path(__file__).parents[4] / "examples/paper_simulation.toml"


def shown(monkeypatch, term, terminal):
    monkeypatch.setenv("TERM", term)
    with os.fdopen(os.dup(terminal[1]), "w") as stderr, redirect_stderr(stderr):
        with progress("begins", 10.0) as show:
            show("goes on", 5.0)
        stderr.write("end")
    return text_until(terminal[0], "end")


def test_a_terminal_shows_what_is_done(terminal, monkeypatch):
    text = shown(monkeypatch, "xterm", terminal)
    assert "flockwire: goes on" in text
    assert text.endswith("end")


def test_in_the_background_nothing_is_drawn(terminal, monkeypatch):
    monkeypatch.setattr("os.tcgetpgrp", lambda _: 1)
    assert shown(monkeypatch, "xterm", terminal) == "end"


def test_a_terminal_without_a_cursor_and_a_file_show_nothing(terminal, monkeypatch, capsys):
    assert shown(monkeypatch, "dumb", terminal) == "end"
    with progress("begins"):
        pass
    assert capsys.readouterr() == ("", "")


class Recorded:
    """Stands for the bar; `seen` has what it was to show."""

    def __init__(self, monkeypatch):
        self.seen = []
        monkeypatch.setattr("flockwire_operator.station.terminal.progress.progress", self)

    def __call__(self, *_):
        return self

    def __enter__(self):
        return lambda *now: self.seen.append(now)

    def __exit__(self, *_):
        pass


def test_a_virtual_flight_shows_each_second(make_plan, monkeypatch, capsys):
    bar = Recorded(monkeypatch)
    simulate(Flight(make_plan().swarm, 1, 3.0), verbose=False)
    assert bar.seen[:3] == [("1 s of flight", 1.0), ("2 s of flight", 2.0), ("3 s of flight", 3.0)]


def test_a_probe_shows_who_attacks(make_plan, monkeypatch, tmp_path):
    swarm, seen = SimulatedSwarm(make_plan()), []
    monkeypatch.setattr(probe, "attackers", lambda *_: iter([(Attacker(name, None, "peer"),) for name in ("a", "b")]))
    monkeypatch.setattr(probe, "_attack", lambda *_: iter(()))

    async def attack():
        operator = Operator(swarm)
        return probe.probe(swarm.plan, tmp_path, operator, print, lambda *now: seen.append(now))

    asyncio.run(attack())
    assert seen == [("attacks as a", 0), ("attacks as b", 1)]


def test_an_interrupted_virtual_flight_is_one_line_and_a_trace_that_can_be_read(tmp_path):
    trace = tmp_path / "out/trace.mcap"
    line = [sys.executable, "-m", "flockwire_operator", "sim", SWARM, "--duration", "100000", "--out", trace.parent]
    with subprocess.Popen(line, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as process:
        wait_until(lambda: process.poll() is not None or (trace.exists() and trace.stat().st_size > 100_000), 60.0)
        process.send_signal(signal.SIGINT)
        said = process.communicate(timeout=30)[1].splitlines()
    assert [line for line in said if "warning" not in line] == ["flockwire: interrupted"]
    assert process.returncode == 130
    assert read_trace(trace).metadata["seed"] == "0"
