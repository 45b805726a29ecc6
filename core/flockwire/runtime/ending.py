"""When a process is told to end: by a signal, or because its parent is gone."""

from __future__ import annotations

import asyncio
import contextlib
import os
import signal
import threading

LIFELINE = "FLOCKWIRE_LIFELINE"  # file descriptor whose end means that the parent is gone
LAST_RESORT = 1.8  # s after the signal to end at which a process ends in any case


def ending() -> asyncio.Event:
    """Return an event that is set on SIGINT, SIGTERM, or when the parent process is gone.

    Once it is set the process has LAST_RESORT seconds to end by itself.
    """
    loop, event = asyncio.get_running_loop(), asyncio.Event()

    def end() -> None:
        if not event.is_set():
            event.set()
            resort = threading.Timer(LAST_RESORT, os._exit, (70,))
            resort.daemon = True
            resort.start()

    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, end)
    lifeline = os.environ.get(LIFELINE)
    if lifeline is not None:
        fd = int(lifeline)

        def gone() -> None:
            with contextlib.suppress(OSError):
                if os.read(fd, 1):
                    return
            loop.remove_reader(fd)
            end()

        loop.add_reader(fd, gone)
    return event
