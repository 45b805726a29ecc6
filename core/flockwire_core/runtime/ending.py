"""Ends a process on a signal, or when its parent is gone; flying drones land first."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager

from flockwire_core import clock
from flockwire_core.process.cores import Core
from flockwire_core.runtime.session import Session
from flockwire_core.runtime.ticker import NO_LOCK

LIFELINE = "FLOCKWIRE_LIFELINE"  # file descriptor whose end means that the parent is gone
LAST_RESORT = 1.8  # s for closing the session
UNDONE = 70  # exit status of a process with unfinished work
POLL = 0.05  # s between two checks whether a process may end


def ending_signals() -> tuple[signal.Signals, ...]:
    """Return the signals that end this process; without SIGHUP if it was started to outlive its terminal (nohup)."""
    outlives = signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
    return (signal.SIGINT, signal.SIGTERM, *(() if outlives else (signal.SIGHUP,)))


class Ending:
    """Watches the running process's signals and its parent, in the running loop."""

    def __init__(self) -> None:
        self.ended = asyncio.Event()  # the process is to end
        self.insisted = False  # a second signal: it ends at once
        self.orphaned = False  # its parent is gone
        loop = asyncio.get_running_loop()
        for number in ending_signals():
            loop.add_signal_handler(number, self._signalled)
        lifeline = os.environ.get(LIFELINE)
        if lifeline is not None:
            loop.add_reader(int(lifeline), self._readable, int(lifeline))

    def _signalled(self) -> None:
        self.insisted = self.ended.is_set() and not self.orphaned
        self.ended.set()

    def _readable(self, lifeline: int) -> None:
        with contextlib.suppress(OSError):
            if os.read(lifeline, 1):
                return
        asyncio.get_running_loop().remove_reader(lifeline)
        self.orphaned = True
        self.ended.set()


async def wait_for_end(
    core: Core,
    session: Session,
    ending: Ending,
    lock: AbstractContextManager[object] = NO_LOCK,
    time: Callable[[int], int] = int,
) -> None:
    """Wait until the process of `session` must end and may, because it has no drone in the air.

    If the parent is gone, it also waits for all linked processes that end before it by the process table. `lock` is
    held while the core is asked, and `time` returns its time at a swarm time (process/stepping.py).
    """
    await ending.ended.wait()
    rows = session.plan.rows
    log, rank = logging.getLogger(session.identity), rows[session.identity].rank
    with lock:
        core.retire(time(clock.now()))
        flying = not core.may_end(time(clock.now()))
    if flying:
        log.info("shutdown: lands first (a second signal ends it at once)")
    while not ending.insisted:
        before = [other for other in session.linked() if other in rows and rows[other].rank < rank]
        with lock:
            if core.may_end(time(clock.now())) and not (ending.orphaned and before):
                break
        await asyncio.sleep(POLL)


@contextlib.contextmanager
def last_resort(identity: str, stop: Callable[[], None]) -> Iterator[None]:
    """Call `stop` after the work in the context, and end the process LAST_RESORT s later in any case.

    The session is closed in this time. The exit status is then 0 if the work is done, without an error: a supervisor
    need not start it again.
    """
    done = False
    try:
        yield
        done = True
    finally:
        stop()
        timer = threading.Timer(LAST_RESORT, _give_up, (identity, done))
        timer.daemon = True
        timer.start()


def _give_up(identity: str, done: bool) -> None:
    logging.getLogger(identity).warning(
        f"the session did not close in {LAST_RESORT} s: its peers have vanished; the process ends, "
        f"its work is {'' if done else 'not '}done"
    )
    threading.Event().wait(0.2)  # s for another thread to write why it did not close
    os._exit(0 if done else UNDONE)
