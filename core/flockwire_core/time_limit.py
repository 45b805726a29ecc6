"""A time limit for a user's code, which may never return."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

LIMIT = 20.0  # s, more than a law takes to be imported, made and compiled
ENDLESS = "still in {name} after {limit:g} s"


class EndlessError(SystemExit):
    """A user's code has not returned in time; not an Exception, so that no `except Exception` of its own ends it."""


@contextmanager
def limited() -> Iterator[None]:
    """Raise EndlessError in the context after LIMIT s; only the main thread, which gets the signals, has a limit."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGALRM, _end)
    signal.setitimer(signal.ITIMER_REAL, LIMIT)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def _end(_: int, frame: FrameType | None) -> None:
    raise EndlessError(ENDLESS.format(name=frame.f_code.co_qualname if frame is not None else "", limit=LIMIT))
