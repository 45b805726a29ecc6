"""The operator takes of a process only what that process itself reports, and publishes its orders."""

from collections import deque
from io import StringIO

import pytest
from flockwire_core import clock
from flockwire_core.domain.airframe import FlightState, Telemetry
from flockwire_core.domain.order import Order
from flockwire_core.domain.time import SECOND
from flockwire_core.wire.codec import encode
from flockwire_core.wire.inbox import Inbox, attachment
from flockwire_core.wire.keys import MISSION, STOP, Key
from flockwire_core.wire.status import Report, Status
from flockwire_operator.station.operator import Operator
from flockwire_operator.station.terminal.display import Rates
from flockwire_operator.station.terminal.display import draw as draw_table
from rich.console import Console


def status(identity, report, stamp):
    return Status(stamp, "world", identity, report, 1, 0, 0, 0, 0, 0.0, 0, (), ())


class Wire:
    """Stands for a session: what is put on a key waits until it is taken."""

    identity = "operator"

    def __init__(self, plan):
        self.plan, self.waiting, self.published = plan, {}, []

    def buffered(self, key):
        self.waiting[key] = deque()
        return Source(Inbox(key), self.waiting[key])

    def publish(self, messages):
        self.published += messages

    def put(self, owner, message, kind="status"):
        waiting = self.waiting[Key(kind, owner)]
        waiting.append((encode(message), attachment(len(waiting), clock.now(), b"p" * 16, Key(kind, owner))))


class Source:
    def __init__(self, inbox, waiting):
        self.inbox, self._waiting = inbox, waiting

    def messages(self, now):
        found = [self.inbox.accept(*one, now) for one in self._waiting]
        self._waiting.clear()
        return [message for message in found if message is not None]


@pytest.fixture
def wire(make_plan):
    return Wire(make_plan())


def test_a_status_is_its_processes_own(wire):
    operator = Operator(wire)
    wire.put("uav1", status("uav1", Report("hold"), clock.now()))
    operator.poll()
    assert {name: told.report.phase for name, told in operator.statuses.items()} == {"uav1": "hold"}


def test_telemetry_is_of_the_drone_whose_key_it_came_on(wire):
    operator = Operator(wire)
    flying = Telemetry(clock.now(), "world", FlightState.FLYING, 0.5, 1.0, 0.0)
    wire.put("uav3", flying, "telemetry")
    operator.poll()
    assert operator.telemetry == {3: flying}
    fleet = operator.core.fleet(operator.poll()).present()
    assert (fleet.states, fleet.fresh) == ({3: FlightState.FLYING}, {})
    assert "uav3" in fleet.not_down()


def test_orders_go_to_their_keys_at_once_a_stop_first(wire):
    operator = Operator(wire)
    operator.ask(Order("land"))
    operator.ask(Order("stop", reason="test"))
    (first, land), (second, stop), (third, again) = wire.published
    assert (first, second, third) == (MISSION, STOP, MISSION)
    assert (land.verb, stop.reason, again) == ("land", "test", land)


@pytest.mark.parametrize("name", ["uav1", "leader", "nobody", ""])
def test_no_process_reports_another(wire, name):
    operator = Operator(wire)
    wire.put("uav1", status("uav1", Report("landing"), clock.now() - SECOND // 2))
    operator.poll()
    wire.put("uav3", status(name, Report("ready"), clock.now()))
    operator.poll()
    assert operator.statuses.keys() <= {"uav1", "uav3"}
    assert operator.statuses["uav1"].report.phase == "landing"


@pytest.mark.parametrize(
    "text",
    [
        "[red", "[[", "]", "[bold]", "\\[",
        "[/nope]",
        "\x1b[2J",
    ],
)  # fmt: skip
def test_whatever_a_process_reports_the_table_is_drawn(text, make_plan):
    now = 1_790_000_000 * SECOND
    for report in (Report(text), Report("hold", f"waits {text}")):
        paper = StringIO()
        Console(file=paper, width=200).print(
            draw_table("t", make_plan(), ("uav1",), {"uav1": status("uav1", report, now)}, Rates(), now)
        )
        assert "uav1" in paper.getvalue()
        assert "\x1b" not in paper.getvalue()
