"""The live table: what it shows of each drone, in 80 columns."""

from io import StringIO

import pytest
from flockwire_core.domain.order import Mission
from flockwire_core.domain.time import SECOND
from flockwire_core.wire.status import Report, Status
from flockwire_operator.station.terminal.table import Rates, draw
from rich.console import Console

NOW = 1_790_000_000 * SECOND
ORDER = Mission(NOW, "world", "start", NOW, "wide_turn")


def of(identity, stamp=NOW, **report):
    whole = Report(**{"phase": "formation", **report})
    return Status(stamp, "world", identity, whole, 900, 3, 0, 0, 0, 0.12, 90 << 20, (), ("gateway", "uav2"))


@pytest.fixture
def drawn(make_plan):
    plan = make_plan()

    def draw_it(*statuses, width=80):
        paper = StringIO()
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
