"""A fixed-rate tick in an asyncio loop, on the monotonic clock, with the lateness of each tick.

On Linux a timerfd (absolute, CLOCK_MONOTONIC) wakes the loop some 0.06 ms after the time; asyncio's own timers, used
elsewhere, are about a millisecond late.
"""

from __future__ import annotations

import asyncio
import ctypes
import os
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from struct import Struct

from flockwire_core import clock
from flockwire_core.domain.time import SECOND, nanoseconds

_CLOCK_MONOTONIC, _ABSOLUTE = 1, 1
_TIMES = Struct("@qqqq")  # interval sec, nsec, first expiry sec, nsec

_LIBC = ctypes.CDLL(None, use_errno=True)
_TIMERFD = hasattr(_LIBC, "timerfd_settime")
if _TIMERFD:
    _LIBC.timerfd_settime.argtypes = (ctypes.c_int, ctypes.c_int, ctypes.c_char_p, ctypes.c_void_p)

NO_LOCK: AbstractContextManager[object] = nullcontext()
Tick = Callable[[int, int], None]  # lateness in ns, ticks skipped since the last


class Ticker:
    """Calls `tick(lateness_ns, skipped)` every `period` s from `start` until `stop`, with `lock` held."""

    def __init__(self, period: float, tick: Tick, lock: AbstractContextManager[object] = NO_LOCK) -> None:
        self._period = nanoseconds(period)
        self._tick, self._lock = tick, lock
        self._next = 0
        self._fd = -1
        self._timer: asyncio.TimerHandle | None = None

    def start(self) -> None:
        """Start ticking in the running loop, first after one period."""
        self._loop = asyncio.get_running_loop()
        self._next = clock.monotonic() + self._period
        if _TIMERFD:
            self._fd = _timerfd(self._next, self._period)
            self._loop.add_reader(self._fd, self._expired)
        else:
            self._timer = self._loop.call_later(self._period / SECOND, self._elapsed)

    def stop(self) -> None:
        """Stop ticking; harmless before `start`."""
        if self._fd >= 0:
            self._loop.remove_reader(self._fd)
            os.close(self._fd)
            self._fd = -1
        if self._timer is not None:
            self._timer.cancel()

    def _expired(self) -> None:
        os.read(self._fd, 8)
        self._fire()

    def _elapsed(self) -> None:
        self._fire()
        delay = max(0, self._next - clock.monotonic()) / SECOND
        self._timer = self._loop.call_later(delay, self._elapsed)

    def _fire(self) -> None:
        with self._lock:
            skipped, late = divmod(max(0, clock.monotonic() - self._next), self._period)
            self._next += (skipped + 1) * self._period
            self._tick(late, skipped)


def _timerfd(first: int, interval: int) -> int:
    fd: int = _LIBC.timerfd_create(_CLOCK_MONOTONIC, os.O_NONBLOCK | os.O_CLOEXEC)
    if fd < 0:
        raise _error()
    times = _TIMES.pack(*divmod(interval, SECOND), *divmod(first, SECOND))
    if _LIBC.timerfd_settime(fd, _ABSOLUTE, times, None) != 0:
        raise _error()
    return fd


def _error() -> OSError:
    code = ctypes.get_errno()
    return OSError(code, f"timerfd: {os.strerror(code)}")
