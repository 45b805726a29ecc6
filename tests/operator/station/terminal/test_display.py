"""What a flight shows: on a terminal a table, on one without a cursor and elsewhere a line for each stage."""

import io
import os
import termios
from contextlib import redirect_stdout
from types import SimpleNamespace

import pytest
from flockwire_core.domain.time import SECOND
from flockwire_core.ground.director import Stage
from flockwire_core.runtime.standard_streams import UnblockedStream, busy, unblocked
from flockwire_operator.station.terminal.display import REFRESH, Display
from terminal_text import text_until

NOW = 1_790_000_000 * SECOND


@pytest.fixture
def screen(terminal):
    """Return both ends of a terminal, and a standard output to it."""
    outlet = UnblockedStream(terminal[1])
    return *terminal, io.TextIOWrapper(io.BufferedWriter(outlet), "utf-8", line_buffering=True)


def show(plan, stages):
    """Show a flight that goes through `stages`."""
    director = SimpleNamespace(stage=Stage.PREPARING, formation_start=None, followed=None)
    operator = SimpleNamespace(statuses={})
    operator.core = SimpleNamespace(director=director)
    display = Display(plan, plan.started, headless=False)
    with display.shown():
        for count, stage in enumerate(stages):
            director.stage = stage
            if stage is Stage.FLYING and director.formation_start is None:
                director.formation_start = NOW + (count + 2) * REFRESH
            display.update(operator, NOW + count * REFRESH)
            display.note("a note")


@pytest.mark.parametrize("term", ["dumb", "unknown"])
def test_a_terminal_without_a_cursor_gets_a_line_for_each_new_stage(make_plan, screen, monkeypatch, term):
    monkeypatch.setenv("TERM", term)
    flown = [Stage.PREPARING, Stage.PREPARING, Stage.TAKING_OFF, Stage.FLYING, Stage.LANDING, Stage.OVER]
    with redirect_stdout(screen[2]):
        show(make_plan(), flown)
    lines = text_until(screen[0], "over").splitlines()
    assert [line for line in lines if "note" not in line] == [
        "flockwire: preparing",
        "flockwire: taking off",
        "flockwire: t = -0.5 s: in formation",  # t = 0 is the formation's start
        "flockwire: t = -0.2 s: landing",
        "flockwire: t = 0.0 s: over",
    ]


def test_a_terminal_that_is_paused_blocks_no_process_and_gets_one_table_when_it_continues(
    make_plan, screen, monkeypatch
):
    monkeypatch.setenv("TERM", "xterm")
    termios.tcflow(screen[1], termios.TCOOFF)
    with redirect_stdout(screen[2]), unblocked():
        try:
            show(make_plan(), 20 * [Stage.FLYING])
            assert busy()
        finally:
            termios.tcflow(screen[1], termios.TCOON)
    os.write(screen[1], b"the end")
    text = text_until(screen[0], "the end")
    assert text.count("a note") == 20
    assert text.count("in formation, ") < 25  # the one that waited; each note draws it again
