"""Sticks become a velocity beyond a dead zone; what is no gamepad, or gone, moves nothing."""

import importlib
import sys
from collections import namedtuple
from types import SimpleNamespace

import pytest
from flockwire_core import clock
from flockwire_core.extras import remedy
from flockwire_operator.station.terminal.gamepad import (
    DEAD_ZONE,
    EAST,
    FORBIDDEN,
    MISSING,
    OTHER_THROTTLE,
    SILENCED,
    SILENT,
    SOUTH,
    THROTTLE,
    AxisRange,
    Gamepad,
    GamepadAxes,
    is_gamepad,
    plugged_in,
)
from hypothesis import given
from hypothesis import strategies as st

TURN, OTHER_TURN = 0x03, 0x02  # the right sticks' other axes
FULL = AxisRange(-32768, 32767, 0)
PAD = dict.fromkeys((EAST, SOUTH, TURN, THROTTLE), FULL)
positions = st.integers(-40000, 40000)

Event = namedtuple("Event", "type code value")
Info = namedtuple("Info", "min max value")


def test_sticks_away_are_north_and_up_and_right_is_east():
    axes = GamepadAxes(0.4, PAD)
    assert axes.velocity() == (0.0, 0.0, 0.0)
    axes.move(SOUTH, -32768)
    assert axes.velocity() == pytest.approx((0.0, 0.4, 0.0), abs=1e-5)
    axes.move(SOUTH, 0)
    axes.move(EAST, 32767)
    assert axes.velocity() == pytest.approx((0.4, 0.0, 0.0), abs=1e-5)
    axes.move(EAST, 0)
    axes.move(THROTTLE, -32768)
    assert axes.velocity() == pytest.approx((0.0, 0.0, 0.4), abs=1e-5)
    axes.rest()
    assert axes.velocity() == (0.0, 0.0, 0.0)


@given(x=positions, y=positions, z=positions)
def test_it_is_never_faster_than_the_leader_may_be(x, y, z):
    axes = GamepadAxes(0.4, PAD)
    for code, value in ((EAST, x), (SOUTH, y), (THROTTLE, z), (99, 32767)):
        axes.move(code, value)
    assert sum(v * v for v in axes.velocity()) ** 0.5 <= 0.4 + 1e-12


def test_in_the_dead_zone_nothing_moves_and_beyond_it_speed_grows_from_nothing():
    axes = GamepadAxes(1.0, PAD)
    speeds = []
    for share in (DEAD_ZONE - 0.01, DEAD_ZONE + 0.01, 0.5, 1.0):
        axes.move(EAST, round(32767 * share))
        speeds.append(axes.velocity()[0])
    assert speeds[0] == 0.0
    assert 0.0 < speeds[1] < 0.02
    assert speeds[2] == pytest.approx((0.5 - DEAD_ZONE) / (1.0 - DEAD_ZONE), abs=1e-3)
    assert speeds[3] == pytest.approx(1.0, abs=1e-3)


BYTES, TRIGGER = AxisRange(0, 255, 128), AxisRange(0, 255, 0)
DUALSHOCK = dict.fromkeys((EAST, SOUTH, OTHER_TURN, OTHER_THROTTLE), BYTES) | dict.fromkeys((TURN, THROTTLE), TRIGGER)


def test_a_pad_whose_triggers_have_the_usual_axis_climbs_by_the_other_one():
    axes = GamepadAxes(0.4, DUALSHOCK)
    for trigger in (255, 128, 0):  # pressed, and let go
        axes.move(THROTTLE, trigger)
        assert axes.velocity() == (0.0, 0.0, 0.0)
    axes.move(OTHER_THROTTLE, 255)
    assert axes.velocity() == pytest.approx((0.0, 0.0, -0.4), abs=0.01)
    assert AxisRange(0, 0, 0).share(7) == 0.0


def test_a_pad_with_one_stick_does_not_climb_by_its_triggers():
    axes = GamepadAxes(0.4, {EAST: BYTES, SOUTH: BYTES, OTHER_TURN: TRIGGER, OTHER_THROTTLE: TRIGGER})
    for trigger in (255, 128, 0):
        axes.move(OTHER_THROTTLE, trigger)
        assert axes.velocity() == (0.0, 0.0, 0.0)
    assert axes.climb is None


def test_a_stick_that_is_held_at_the_start_acts_after_it_was_in_its_middle():
    axes = GamepadAxes(0.4, PAD | {EAST: AxisRange(-100, 100, 100)})
    axes.move(EAST, 90)
    assert axes.velocity() == (0.0, 0.0, 0.0)
    axes.move(EAST, 3)
    axes.move(EAST, 100)
    assert axes.velocity() == pytest.approx((0.4, 0.0, 0.0), abs=1e-5)


class Device:
    """What evdev gives of a gamepad; `where` are the positions of its axes."""

    name, fd = "Pad", -1

    def __init__(self, *events):
        self.events, self.where = events, dict.fromkeys(PAD, 0)

    def capabilities(self):
        return {1: [0x130], 3: [(code, Info(-100, 100, 0)) for code in PAD]}

    def absinfo(self, code):
        return Info(-100, 100, self.where[code])

    def read(self):
        return iter(self.events)


def test_events_of_axes_count_and_dropped_ones_are_asked_for():
    pad = Gamepad(Device(Event(3, SOUTH, -100), Event(1, 0x130, 1), Event(0, 0, 0)), 0.4)
    pad.read()
    assert pad.axes.velocity() == pytest.approx((0.0, 0.4, 0.0))
    device = Device(Event(0, 3, 0))
    pad = Gamepad(device, 0.4)
    device.where[EAST] = 100
    pad.read()
    assert pad.axes.velocity() == pytest.approx((0.4, 0.0, 0.0), abs=1e-5)


def test_a_deflected_stick_without_events_stops_the_leader_until_it_was_in_its_middle(capsys):
    device = Device(Event(3, EAST, 100))
    pad = Gamepad(device, 0.4)
    pad.read()
    now = clock.monotonic()
    assert pad.velocity(now) == pytest.approx((0.4, 0.0, 0.0), abs=1e-5)
    assert pad.velocity(now + SILENT) == (0.0, 0.0, 0.0)
    assert SILENCED.format(name="Pad", seconds=2.0) in capsys.readouterr().out
    pad.read()
    assert pad.velocity(now) == (0.0, 0.0, 0.0)
    device.events = (Event(3, EAST, 0), Event(3, EAST, 100))
    pad.read()
    assert pad.velocity(now) == pytest.approx((0.4, 0.0, 0.0), abs=1e-5)


def test_a_gamepad_without_permission_is_named_with_the_remedy(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "evdev", SimpleNamespace(list_devices=lambda _: []))  # it leaves out the others
    assert plugged_in(0.4, tmp_path) == (None, "")
    for node in ("event5", "js0"):
        (tmp_path / node).touch()
    assert plugged_in(0.4, tmp_path) == (None, FORBIDDEN.format(file=tmp_path / "event5"))


def test_a_mouse_is_not_a_gamepad():
    assert is_gamepad(Device().capabilities())
    assert is_gamepad(Device().capabilities() | {1: [0x120]})  # a pad whose buttons have no names
    assert not is_gamepad({1: [0x110], 2: [0, 1]})
    assert not is_gamepad({1: [0x130], 3: [(EAST, Info(0, 1, 0))]})


def test_a_missing_package_is_named_where_a_gamepad_is_there(tmp_path, monkeypatch):
    def without(name):
        raise ImportError(name)

    monkeypatch.setattr(importlib, "import_module", without)
    assert plugged_in(0.4, tmp_path) == (None, "")
    (tmp_path / "js0").touch()
    assert plugged_in(0.4, tmp_path) == (None, MISSING)
    assert remedy("gamepad") in MISSING
