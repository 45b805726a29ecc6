"""Orders by single keys while `up` or `conduct` flies: h hold, l land, f resume the formation, s twice stop."""

from __future__ import annotations

import asyncio
import contextlib
import os
import sys
import termios
import tty
from collections.abc import Callable, Iterator
from typing import TextIO

from flockwire_core import clock
from flockwire_core.domain.time import SECOND

TWICE = SECOND  # ns for the second press of a stop
VERBS = {"h": "hold", "l": "land", "f": "resume"}
HINT = "h hold, f resume, l land, ss stop"
INTERRUPT = "Ctrl-C lands"


class Keyboard:
    """Converts keys to orders; calls `order` with "hold", "land", "resume" or "stop"."""

    def __init__(self, order: Callable[[str], None]) -> None:
        self._order = order
        self._pressed = 0  # last press of s, ns

    def press(self, key: str, now: int) -> None:
        """Take one key that was pressed at `now` (ns of a clock that does not go back)."""
        if key == "s":
            if now - self._pressed <= TWICE:
                self._order("stop")
            self._pressed = now
        elif key in VERBS:
            self._order(VERBS[key])


def foreground(stream: TextIO | None) -> bool:
    """Return whether `stream` is this process's terminal, and this process is not in its background.

    Who changes or reads a terminal from the background is stopped by the kernel (SIGTTOU, SIGTTIN); who shares that of
    another session (setsid) takes its keys.
    """
    try:
        return stream is not None and os.tcgetpgrp(stream.fileno()) == os.getpgrp()
    except (OSError, ValueError):  # no terminal, another session's, or closed
        return False


def attached() -> bool:
    """Return whether there is a terminal to read keys from."""
    return foreground(sys.stdin)


def hint() -> str:
    """Return the keys that are orders here."""
    return f"{HINT}; {INTERRUPT}" if attached() else INTERRUPT


@contextlib.contextmanager
def keys_pressed(press: Callable[[str, int], None]) -> Iterator[None]:
    """Call `press` as Keyboard has it for the terminal's keys, in the running loop; without a terminal do nothing.

    Ctrl-Z is a key too: a stopped process would conduct nothing while the drones fly.
    """
    controls = 6  # the control characters in the list of tcgetattr
    if not attached():
        yield
        return
    fd, loop = sys.stdin.fileno(), asyncio.get_running_loop()
    before = termios.tcgetattr(fd)

    def readable() -> None:
        data = b""
        with contextlib.suppress(OSError):
            if attached():
                data = os.read(fd, 64)
        if not data:  # the terminal is gone, or another's
            loop.remove_reader(fd)
        for key in data.decode(errors="replace"):
            press(key, clock.monotonic())

    tty.setcbreak(fd, termios.TCSANOW)  # another `when` waits for a paused terminal
    modes = termios.tcgetattr(fd)
    modes[controls][termios.VSUSP] = bytes([os.fpathconf(fd, "PC_VDISABLE")])
    termios.tcsetattr(fd, termios.TCSANOW, modes)
    loop.add_reader(fd, readable)
    try:
        yield
    finally:
        loop.remove_reader(fd)
        with contextlib.suppress(termios.error):
            if attached():
                termios.tcsetattr(fd, termios.TCSANOW, before)
