"""Reports to supervisors named by the environment: systemd's watchdog, and a container's health check.

Both depend only on completed steps, reported by the status ten times a second: a process whose loop runs but whose core
does not step is not healthy.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import os
import socket
from collections.abc import Mapping

from flockwire_core import clock
from flockwire_core.domain.time import MICROSECOND, SECOND
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.status import Report

HEALTH = "FLOCKWIRE_HEALTH"  # path of the Unix socket for health checks
NOTIFY, WATCHDOG = "NOTIFY_SOCKET", "WATCHDOG_USEC"  # as sd_notify(3) has them


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
