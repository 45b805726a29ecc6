"""A connected gamepad, read by the package evdev (Linux only).

The left stick is a velocity north, south, east, west, the right one up and down:

    v = speed · s / |s| · max(0, |s| − d) / (1 − d),    d = DEAD_ZONE, |s| at most 1

A stick that does not return exactly to its middle has no effect, and the velocity does not jump. An axis acts after it
was once in its middle: one that rests at an end is a trigger. A pad whose receiver stays while it sleeps, or is out of
reach, has no event of its own; so a deflected stick acts for SILENT without an event, which a hand's tremor gives.
"""

from __future__ import annotations

import asyncio
import contextlib
import importlib
from collections.abc import Iterator, Mapping
from math import hypot
from pathlib import Path
from typing import Any, NamedTuple

from flockwire_core import clock
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import ZERO, Vector, limit
from flockwire_core.extras import remedy

INPUTS = Path("/dev/input")
MISSING = f"a gamepad is connected; to use it: {remedy('gamepad')}"
FORBIDDEN = (
    "a gamepad is connected, but {file} may not be read: add your user to the group `input` "
    "(sudo usermod -aG input $USER) and log in again"
)
NO_CLIMB = "{name} has no right stick that rested in its middle: it does not climb; let go of it and start again"
GONE = "{name} is gone: the leader stops; start again when it is back"
SILENCED = "{name} has reported nothing for {seconds:g} s: the leader stops; centre the sticks to go on"
SILENT = 2 * SECOND  # ns that a deflected stick acts without an event
KEYS, AXES = 0x01, 0x03  # EV_KEY, EV_ABS
BUTTONS = {0x120, 0x130}  # BTN_TRIGGER, BTN_SOUTH: a pad or a joystick has one, no mouse, tablet or keyboard
SYNCHRONISATION, DROPPED = 0x00, 0x03  # EV_SYN, SYN_DROPPED: the kernel's event queue was full
DEAD_ZONE = 0.15  # share of a stick's deflection
EAST, SOUTH, THROTTLE, OTHER_THROTTLE = 0x00, 0x01, 0x04, 0x05  # ABS_X, ABS_Y, ABS_RY, ABS_RZ
RIGHT_STICKS = ((0x03, THROTTLE), (0x02, OTHER_THROTTLE))  # ABS_RX, ABS_RY; or ABS_Z, ABS_RZ, beside triggers


class AxisRange(NamedTuple):
    """The ends of an axis, and where it was at the start, in its own units."""

    low: int
    high: int
    start: int

    def share(self, value: int) -> float:
        """Return the deflection of `value`, from -1 to 1; 0 for an axis without a range."""
        if self.high <= self.low:
            return 0.0
        return max(-1.0, min(2.0 * (value - self.low) / (self.high - self.low) - 1.0, 1.0))


class GamepadAxes:
    """Converts positions of the axes in `ranges`, by code, to a velocity of at most `speed` m/s, world frame."""

    def __init__(self, speed: float, ranges: Mapping[int, AxisRange]) -> None:
        self._speed, self._ranges = speed, ranges
        self._shares: dict[int, float] = {}  # of axes that were in their middle
        for code, axis in ranges.items():
            self.move(code, axis.start)
        sticks = (climb for turn, climb in RIGHT_STICKS if {turn, climb} <= self._shares.keys())
        self.climb = next(sticks, None)

    def move(self, code: int, value: int) -> None:
        """Set the position of an axis; others, and those that have not yet been in their middle, are ignored."""
        if code in self._ranges:
            share = self._ranges[code].share(value)
            if code in self._shares or abs(share) <= DEAD_ZONE:
                self._shares[code] = share

    def rest(self) -> None:
        """Centre all sticks, because the gamepad is gone or silent; each acts again after it was in its middle."""
        self._shares.clear()

    def velocity(self) -> Vector:
        """Return the velocity to command; sticks point away (up) at their low end."""
        east, north = self._shares.get(EAST, 0.0), -self._shares.get(SOUTH, 0.0)
        climb = 0.0 if self.climb is None else -self._shares.get(self.climb, 0.0)
        level = _beyond(hypot(east, north))
        return limit(
            (self._speed * level * east, self._speed * level * north, self._speed * _beyond(abs(climb)) * climb),
            self._speed,
        )


class Gamepad:
    """An open gamepad, `device` of evdev, whose sticks command at most `speed` m/s."""

    def __init__(self, device: Any, speed: float) -> None:  # noqa: ANN401  (evdev.InputDevice, which may be absent)
        self.name: str = device.name
        self._device = device
        axes = device.capabilities()[AXES]
        ranges = {code: AxisRange(info.min, info.max, device.absinfo(code).value) for code, info in axes}
        self._reported = clock.monotonic()  # last event, ns
        self._ranges, self.axes = ranges, GamepadAxes(speed, ranges)

    def read(self) -> None:
        """Read pending events; raises OSError if the gamepad is gone."""
        self._reported = clock.monotonic()
        for event in self._device.read():
            if event.type == AXES:
                self.axes.move(event.code, event.value)
            elif (event.type, event.code) == (SYNCHRONISATION, DROPPED):
                for code in self._ranges:
                    self.axes.move(code, self._device.absinfo(code).value)

    def velocity(self, now: int) -> Vector:
        """Return the velocity to command at `now` (ns of clock.monotonic); sticks of a silent gamepad are at rest."""
        if self.axes.velocity() != ZERO and now - self._reported > SILENT:
            self.axes.rest()
            print(f"flockwire: {SILENCED.format(name=self.name, seconds=SILENT / SECOND)}", flush=True)
        return self.axes.velocity()

    @contextlib.contextmanager
    def followed(self) -> Iterator[None]:
        """Read in the running loop during the context; a disconnected gamepad is at rest."""
        loop = asyncio.get_running_loop()

        def readable() -> None:
            try:
                self.read()
            except BlockingIOError:
                pass  # another reader was faster
            except OSError:
                loop.remove_reader(self._device.fd)
                self.axes.rest()
                print(f"flockwire: {GONE.format(name=self.name)}", flush=True)

        loop.add_reader(self._device.fd, readable)
        try:
            yield
        finally:
            loop.remove_reader(self._device.fd)
            self._device.close()


def plugged_in(speed: float, inputs: Path = INPUTS) -> tuple[Gamepad | None, str]:
    """Return the first connected gamepad, or None; and a note about it."""
    joystick = any(inputs.glob("js*"))
    try:
        evdev: Any = importlib.import_module("evdev")
    except ImportError:
        return None, MISSING if joystick else ""
    readable = sorted(evdev.list_devices(str(inputs)))
    for path in readable:
        with contextlib.suppress(OSError):
            device = evdev.InputDevice(path)
            if is_gamepad(device.capabilities()):
                gamepad = Gamepad(device, speed)
                return gamepad, NO_CLIMB.format(name=gamepad.name) if gamepad.axes.climb is None else ""
            device.close()
    closed = sorted({str(path) for path in inputs.glob("event*")} - set(readable))
    return None, FORBIDDEN.format(file=closed[0]) if joystick and closed else ""


def is_gamepad(capabilities: dict[int, list[Any]]) -> bool:
    """Return whether a device of these `capabilities` (codes by type, axes with ranges) has sticks."""
    axes = {code for code, _ in capabilities.get(AXES, ())}
    return not BUTTONS.isdisjoint(capabilities.get(KEYS, ())) and {EAST, SOUTH} <= axes


def _beyond(deflection: float) -> float:
    """Return the factor of a stick with this deflection that removes the dead zone."""
    if deflection <= DEAD_ZONE:
        return 0.0
    return (min(deflection, 1.0) - DEAD_ZONE) / (1.0 - DEAD_ZONE) / deflection
