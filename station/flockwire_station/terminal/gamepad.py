"""A connected gamepad, read by the package evdev (Linux only).

The left stick is a velocity north, south, east, west, the right one up and down:

    v = speed · s / |s| · max(0, |s| − d) / (1 − d),    d = DEAD_ZONE, |s| at most 1

A stick that does not return exactly to its middle has no effect, and the velocity does not jump.
"""

from __future__ import annotations

import asyncio
import contextlib
import importlib
from collections.abc import Iterator, Mapping
from math import hypot
from pathlib import Path
from typing import Any, NamedTuple

from flockwire.domain.vector import Vector, limit
from flockwire.extras import remedy

INPUTS = Path("/dev/input")
MISSING = f"a gamepad is connected; to use it: {remedy('gamepad')}"
KEYS, AXES = 0x01, 0x03  # EV_KEY, EV_ABS
A_BUTTON = 0x130  # BTN_SOUTH: every gamepad has it, no mouse, tablet or keyboard
SYNCHRONISATION, DROPPED = 0x00, 0x03  # EV_SYN, SYN_DROPPED: the kernel's event queue was full
DEAD_ZONE = 0.15  # share of a stick's deflection
EAST, SOUTH, THROTTLE, OTHER_THROTTLE = 0x00, 0x01, 0x04, 0x05  # ABS_X, ABS_Y, ABS_RY; pads without it have ABS_RZ


class AxisRange(NamedTuple):
    """The ends of an axis, in its own units."""

    low: int
    high: int

    def share(self, value: int) -> float:
        """Return the deflection of `value`, from -1 to 1; 0 for an axis without a range."""
        if self.high <= self.low:
            return 0.0
        return max(-1.0, min(2.0 * (value - self.low) / (self.high - self.low) - 1.0, 1.0))


class GamepadAxes:
    """Converts positions of the axes in `ranges`, by code, to a velocity of at most `speed` m/s, world frame."""

    def __init__(self, speed: float, ranges: Mapping[int, AxisRange]) -> None:
        self._speed, self._ranges = speed, ranges
        self._climb = THROTTLE if THROTTLE in ranges else OTHER_THROTTLE
        self._shares: dict[int, float] = {}

    def move(self, code: int, value: int) -> None:
        """Set the position of an axis; other axes are ignored."""
        if code in self._ranges:
            self._shares[code] = self._ranges[code].share(value)

    def rest(self) -> None:
        """Centre all sticks, because the gamepad is gone."""
        self._shares.clear()

    def velocity(self) -> Vector:
        """Return the velocity to command; sticks point away (up) at their low end."""
        east, north = self._shares.get(EAST, 0.0), -self._shares.get(SOUTH, 0.0)
        climb = -self._shares.get(self._climb, 0.0)
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
        ranges = {code: AxisRange(info.min, info.max) for code, info in device.capabilities()[AXES]}
        self._codes = tuple(ranges)
        self.axes = GamepadAxes(speed, ranges)

    def read(self) -> None:
        """Read pending events; raises OSError if the gamepad is gone."""
        for event in self._device.read():
            if event.type == AXES:
                self.axes.move(event.code, event.value)
            elif (event.type, event.code) == (SYNCHRONISATION, DROPPED):
                for code in self._codes:
                    self.axes.move(code, self._device.absinfo(code).value)

    @contextlib.contextmanager
    def followed(self) -> Iterator[None]:
        """Read in the running loop during the context; a disconnected gamepad is at rest."""
        loop = asyncio.get_running_loop()

        def readable() -> None:
            try:
                self.read()
            except OSError:
                loop.remove_reader(self._device.fd)
                self.axes.rest()
                print(f"flockwire: {self.name} is gone", flush=True)

        loop.add_reader(self._device.fd, readable)
        try:
            yield
        finally:
            loop.remove_reader(self._device.fd)
            self._device.close()


def plugged_in(speed: float, inputs: Path = INPUTS) -> tuple[Gamepad | None, str]:
    """Return the first connected gamepad, or None; and a note about it."""
    try:
        evdev: Any = importlib.import_module("evdev")
    except ImportError:
        return None, MISSING if next(inputs.glob("js*"), None) is not None else ""
    for path in sorted(evdev.list_devices(str(inputs))):
        with contextlib.suppress(OSError):
            device = evdev.InputDevice(path)
            if is_gamepad(device.capabilities()):
                return Gamepad(device, speed), ""
            device.close()
    return None, ""


def is_gamepad(capabilities: dict[int, list[Any]]) -> bool:
    """Return whether a device of these `capabilities` (codes by type, axes with ranges) has sticks."""
    axes = {code for code, _ in capabilities.get(AXES, ())}
    return A_BUTTON in capabilities.get(KEYS, ()) and {EAST, SOUTH} <= axes


def _beyond(deflection: float) -> float:
    """Return the factor of a stick with this deflection that removes the dead zone."""
    if deflection <= DEAD_ZONE:
        return 0.0
    return (min(deflection, 1.0) - DEAD_ZONE) / (1.0 - DEAD_ZONE) / deflection
