"""What a flight shows: on a terminal a table, on one without a cursor and elsewhere a line for each stage."""

import io
import os
import termios
from contextlib import redirect_stdout
from types import SimpleNamespace

import pytest
from flockwire_core.domain.order import Mission
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.ground.director import Stage
from flockwire_core.runtime.standard_streams import UnblockedStream, busy, unblocked
from flockwire_core.wire.status import Report, Status
from flockwire_operator.station.terminal.display import REFRESH, Display, Rates, draw
from rich.console import Console
from terminal_text import text_until

NOW = 1_790_000_000 * SECOND
ORDER = Mission(NOW, "world", "start", NOW, "wide_turn")


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


def of(identity, stamp=NOW, **report):
    whole = Report(**{"phase": "formation", **report})
    return Status(stamp, "world", identity, whole, 900, 3, 0, 0, 0, 0.12, 90 << 20, (), ("gateway", "uav2"))


@pytest.fixture
def drawn(make_plan):
    plan = make_plan()

    def draw_it(*statuses, width=80):
        paper = io.StringIO()
        known = {status.identity: status for status in statuses}
        Console(file=paper, width=width).print(draw("flock: formation, 12 s", plan, plan.started, known, Rates(), NOW))
        return paper.getvalue().splitlines()

    return draw_it


def line_of(lines, identity):
    return next(line for line in lines if line.startswith(identity)).split()


def test_a_drone_s_place_battery_formation_and_error_are_in_its_line(drawn):
    flown = of(
        "uav1", position=(-10.25, 3.5, 1.02), battery=0.83, formation_error=0.0123, pose_age=0.004, mission=ORDER
    )
    words = line_of(drawn(flown), "uav1")
    assert words == [
        "uav1",
        "formation",
        "wide_turn",
        "-10.25",
        "3.50",
        "1.02",
        "83%",
        "12.3",
        "4.0",
    ]  # the rate is not known yet


@pytest.mark.parametrize(("verb", "shown"), [("start", "wide_turn"), ("formation", "wide_turn"), ("hold", "0.00")])
def test_the_formation_is_shown_after_a_start_and_after_a_change_to_it(drawn, verb, shown):
    flown = of("uav1", position=(0.0, 0.0, 1.0), mission=ORDER._replace(verb=verb))
    assert line_of(drawn(flown), "uav1")[2] == shown


def test_it_fits_eighty_columns_whatever_happens(drawn):
    long = "waits for " + 30 * "something "
    lines = drawn(
        *(
            of(f"uav{i}", position=(-10.25, -10.5, 12.0), battery=1.0, formation_error=12.5, mission=ORDER)
            for i in range(5)
        ),
        of("leader", detail=long),
        of("gateway", NOW - 200 * SECOND),
    )
    assert max(map(len, lines)) <= 80
    assert all(word in " ".join(lines) for word in ("phase", "formation", "height", "battery", "error mm"))
    assert "silent" in " ".join(line_of(lines, "gateway"))


def test_what_keeps_a_process_is_said_under_the_table(drawn):
    assert "uav3: waits for gateway" in drawn(of("uav3", phase="grounded", detail="waits for gateway"))


def test_who_has_no_status_is_there_anyway(drawn):
    assert line_of(drawn(), "uav4") == ["uav4", "no", "status"]


def status(seconds, steps, identity="uav1"):
    stamp = NOW + nanoseconds(seconds)
    return Status(stamp, "world", identity, Report("hold"), steps, 0, 0, 0, 0, 0.0, 0, (), ())


def told(*statuses):
    """Return the rate after the last of `statuses`, (seconds, steps) each."""
    rates = Rates()
    return [rates.rate(status(*each)) for each in statuses][-1]


def test_the_first_status_gives_no_rate():
    assert told((0.0, 500)) == -1.0


def test_the_rate_is_that_of_the_last_half_second_or_more():
    assert told((0.0, 0), (0.5, 50)) == pytest.approx(100.0)
    assert told((0.0, 0), (0.5, 50), (1.0, 75)) == pytest.approx(50.0)


def test_in_between_the_last_rate_stays():
    assert told((0.0, 0), (0.5, 50), (0.6, 90), (0.9, 95)) == pytest.approx(100.0)


def test_a_frozen_one_has_no_rate():
    assert told((0.0, 0), (0.5, 50), (1.0, 50)) == 0.0


def test_a_process_that_restarted_counts_from_there():
    assert told((0.0, 1000), (0.5, 1050), (0.7, 10), (1.2, 60)) == pytest.approx(100.0)


def test_the_same_status_twice_changes_nothing():
    assert told((0.0, 0), (0.5, 50), (0.5, 50)) == pytest.approx(100.0)


def test_processes_are_counted_apart():
    rates = Rates()
    for seconds, steps in ((0.0, 0), (0.5, 50)):
        slow = rates.rate(status(seconds, steps // 10, "recorder"))
        fast = rates.rate(status(seconds, steps))
    assert (slow, fast) == (pytest.approx(10.0), pytest.approx(100.0))
