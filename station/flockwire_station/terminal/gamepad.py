"""A connected gamepad, read by the package evdev (Linux only)."""

from __future__ import annotations

import asyncio
import contextlib
import importlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from flockwire.extras import remedy

from flockwire_station.terminal.gamepad_axes import EAST, SOUTH, AxisRange, GamepadAxes

INPUTS = Path("/dev/input")
MISSING = f"a gamepad is connected; to use it: {remedy('gamepad')}"
KEYS, AXES = 0x01, 0x03  # EV_KEY, EV_ABS
A_BUTTON = 0x130  # BTN_SOUTH: every gamepad has it, no mouse, tablet or keyboard
SYNCHRONISATION, DROPPED = 0x00, 0x03  # EV_SYN, SYN_DROPPED: the kernel's event queue was full


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
