"""What this process reports of itself: its status with its costs and links, to the swarm and to its supervisors.

Supervisors are named by the environment: systemd's watchdog, and a container's health check. Both depend only on
completed steps, reported by the status ten times a second: a process whose loop runs but whose core does not step is
not healthy.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import os
import resource
import socket
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path

from flockwire_core import clock
from flockwire_core.domain.time import MICROSECOND, SECOND
from flockwire_core.process.stepping import Resources, StatusPublisher
from flockwire_core.process.timekeeping import Timekeeping
from flockwire_core.runtime.refusals import Refusals
from flockwire_core.runtime.session import Session
from flockwire_core.wire.codec import Message
from flockwire_core.wire.keys import Key
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.status import Report, Status

HEALTH = "FLOCKWIRE_HEALTH"  # path of the Unix socket for health checks
NOTIFY, WATCHDOG = "NOTIFY_SOCKET", "WATCHDOG_USEC"  # as sd_notify(3) has them


def status_publisher(
    session: Session, refusals: Refusals, timed: Timekeeping, loop: asyncio.AbstractEventLoop | None = None
) -> StatusPublisher:
    """Return the function that publishes the status of a session's process, logs it and reports it to supervisors.

    `loop` is as `ProcessResources` has it.
    """
    identity, frame = session.identity, session.plan.swarm.frame
    resources, supervision = ProcessResources(session, refusals, loop).at, Supervision(identity)

    def publish(messages: Iterable[tuple[Key, Message]]) -> None:
        for key, message in messages:
            session.publish(((key, message),))
            if isinstance(message, Status):
                supervision.completed(message.report)

    return StatusPublisher(frame, identity, publish, resources, timed, logging.getLogger(identity).info)


class ProcessResources:
    """What this process costs, and how it is connected.

    A caller on Zenoh's thread names the `loop` that looks at the links: to look on that thread would hand all its work
    over to another one.
    """

    def __init__(self, session: Session, refusals: Refusals, loop: asyncio.AbstractEventLoop | None) -> None:
        self._session, self._refusals, self._loop = session, refusals, loop
        self._links: tuple[str, ...] = ()
        self._resident = 0
        self._look_at = 0
        self._at, self._used = clock.now(), clock.cpu_time()
        if loop is not None:
            self._look()

    def at(self, now: int) -> Resources:
        """Return those at `now` (Unix ns): the share of a core since the last call.

        The most memory that was resident, and who is linked, are as of a second or so ago: to look takes a while.
        """
        used, elapsed = clock.cpu_time(), max(1, now - self._at)
        share = (used - self._used) * SECOND / elapsed
        self._at, self._used = now, used
        if clock.monotonic() >= self._look_at:
            self._look_at = clock.monotonic() + SECOND
            if self._loop is None:
                self._look()
            else:
                self._loop.call_soon_threadsafe(self._look)
        return Resources(share, self._resident, self._refusals.count, self._links)

    def _look(self) -> None:
        self._links, self._resident = self._session.linked(), peak_memory()
        self._session.guard()


def peak_memory() -> int:
    """Return the peak resident memory of this process, in bytes.

    On Linux it is read from /proc, because getrusage(2) starts with the parent's value.
    """
    try:
        status = Path("/proc/self/status").read_text(encoding="utf-8")
        return int(status.partition("VmHWM:")[2].split(maxsplit=1)[0]) * 1024
    except (OSError, ValueError, IndexError):
        most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        return most if sys.platform == "darwin" else most * 1024


class Supervision:
    """Reports the steps of `identity` to the supervisors that `environment` names, from the running loop."""

    def __init__(self, identity: str, environment: Mapping[str, str] = os.environ) -> None:
        self._identity, self._report, self._stepped = identity, Report(Phase.STARTING), 0
        notify, self._period = environment.get(NOTIFY, ""), int(environment.get(WATCHDOG, 1_000_000)) * MICROSECOND // 2
        self._notify = _connected(notify) if notify else None
        self._due = 0  # next notification of systemd, monotonic ns
        health = environment.get(HEALTH, "")
        answering = _answering(identity, health) if health else None
        if answering is not None:
            asyncio.get_running_loop().add_reader(answering, self._answer, answering)

    def completed(self, report: Report) -> None:
        """Record a completed step, with the process's `report`."""
        self._report, self._stepped = report, clock.monotonic()
        if self._notify is None or self._stepped < self._due:
            return
        message = b"WATCHDOG=1" if self._due else b"READY=1\nWATCHDOG=1"
        with contextlib.suppress(OSError):  # a busy systemd is notified at the next step
            self._notify.send(message)
            self._due = self._stepped + self._period

    def answer(self, now: int) -> bytes:
        """Return the state of the process at `now` (monotonic ns), as JSON; null is the age before the first step."""
        age = (now - self._stepped) / SECOND if self._stepped else None
        phase, detail = self._report.phase, self._report.line
        return json.dumps({"identity": self._identity, "phase": phase, "detail": detail, "step_age_s": age}).encode()

    def _answer(self, health: socket.socket) -> None:
        with contextlib.suppress(OSError):  # the client is gone
            _, asker = health.recvfrom(1)
            if asker:
                health.sendto(self.answer(clock.monotonic()), asker)


def _connected(address: str) -> socket.socket | None:
    """Return a socket to systemd's `address`; an `@` means the zero byte of an abstract one."""
    sender = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK)
    with contextlib.suppress(OSError):
        sender.connect(f"\0{address[1:]}" if address.startswith("@") else address)
    return sender


def _answering(identity: str, path: str) -> socket.socket | None:
    """Return a socket at `path`, replacing that of a killed process; None if it cannot be made."""
    receiver = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK)
    try:
        with contextlib.suppress(FileNotFoundError):
            os.unlink(path)  # noqa: PTH108  (a Path of it is needed nowhere else)
        receiver.bind(path)
    except OSError as error:
        logging.getLogger(identity).warning(
            "%s = %r: cannot answer health checks there: %s", HEALTH, path, error.strerror
        )
        receiver.close()
        return None
    return receiver
