"""The thin shell round every core: receive, step, publish, keep rate, tell how it is, end clean.

A core has no clock and no input or output. Its shell hands it messages and the time, publishes what a step returns,
and sends its status ten times a second.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import resource
import signal
import sys
import threading
from collections.abc import Coroutine, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from flockwire import clock, policy
from flockwire.credentials import CredentialsError
from flockwire.keys import Key, key_text
from flockwire.messages import Message, Report, Status
from flockwire.refusals import Refusals
from flockwire.session import EndpointInUseError, Newest, Prompt, Session, connect
from flockwire.ticker import BILLION, Ticker

if TYPE_CHECKING:
    from flockwire.config import Swarm

LIFELINE = "FLOCKWIRE_LIFELINE"  # file descriptor whose end means that the parent is gone
STATUS_PERIOD = BILLION // 10
LAST_RESORT = 1.8  # s after the signal to end at which a process ends in any case


class Core(Protocol):
    """What a process does, without clock, input and output."""

    @property
    def trigger(self) -> Key | None:
        """The key whose arrival calls for a step; None for a core that steps at a rate of its own."""

    @property
    def prompt(self) -> frozenset[Key]:
        """Further keys that are handed over as soon as they arrive; all others rest until the next step."""

    @property
    def period(self) -> float:
        """Seconds between steps (with a trigger: when to step without one)."""

    def receive(self, key: Key, message: Message, now: int) -> None:
        """Take a message in at `now`, Unix time in ns."""

    def step(self, now: int) -> Iterable[tuple[Key, Message]]:
        """Return what to publish at `now`, Unix time in ns."""

    def report(self, now: int) -> Report:
        """Return how it is at `now`."""


class Deadlines:
    """Counts steps, those that came late, and those that did not come."""

    def __init__(self) -> None:
        self.steps = self.late_1ms = self.late_5ms = self.skipped = 0

    def count(self, lateness: int, skipped: int) -> None:
        """Count one step that came `lateness` ns after its time, and `skipped` steps missed before it."""
        self.steps += 1
        self.late_1ms += lateness > 1_000_000
        self.late_5ms += lateness > 5_000_000
        self.skipped += skipped


class Shell:
    """Runs one core on one session in the running loop."""

    def __init__(self, core: Core, swarm: Swarm, identity: str, session: Session, refusals: Refusals) -> None:
        self._core, self._swarm, self._session = core, swarm, session
        self._deadlines = Deadlines()
        self._teller = Teller(swarm, identity, session, refusals)
        self._running = False
        self._stepped = False
        self._next_stamp = 0
        heard = policy.hears(swarm, identity)
        at_once = core.prompt | {core.trigger}
        self._rings: list[Newest] = [session.newest(key) for key in heard if key not in at_once]
        prompts = [
            session.prompt(key, self._triggered if key == core.trigger else self._arrived)
            for key in heard
            if key in at_once
        ]
        self._sources: tuple[Newest | Prompt, ...] = (*self._rings, *prompts)
        # With a trigger the ticker is the watchdog for when it stops: every second period it looks for a step.
        self._ticker = Ticker(core.period * (2 if core.trigger else 1), self._tick)

    def start(self) -> None:
        """Begin."""
        self._running = True
        self._ticker.start()

    def stop(self) -> None:
        """Step no more; what Zenoh's threads still announce is left alone."""
        self._running = False
        self._ticker.stop()

    def _triggered(self, prompt: Prompt) -> None:
        """Step for the message that this core waits for."""
        now = clock.now()
        received = prompt.take(now) if self._running else None
        if received is None:
            return
        self._core.receive(prompt.inbox.key, received.message, now)
        stamp = received.message.stamp
        if stamp >= self._next_stamp:  # poses may come faster than the control rate
            self._next_stamp = stamp + round(self._core.period / 2 * BILLION)
            self._deadlines.count(now - received.origin.sent, received.missed)
            self._step(now)

    def _arrived(self, prompt: Prompt) -> None:
        now = clock.now()
        received = prompt.take(now) if self._running else None
        if received is not None:
            self._core.receive(prompt.inbox.key, received.message, now)

    def _tick(self, lateness: int, skipped: int) -> None:
        stepped, self._stepped = self._stepped, False
        if self._core.trigger is None:
            self._deadlines.count(lateness, skipped)
        elif stepped:
            return
        self._step(clock.now())

    def _step(self, now: int) -> None:
        self._stepped = True
        for ring in self._rings:
            received = ring.take(now)
            if received is not None:
                self._core.receive(ring.inbox.key, received.message, now)
        for key, message in self._core.step(now):
            self._session.publish(key, message)
        if self._teller.due(now):
            self._teller.tell(now, self._core.report(now), self._deadlines, self._rejected())

    def _rejected(self) -> tuple[tuple[str, int], ...]:
        return tuple(
            (f"{key_text(self._swarm, source.inbox.key)} {reason}", count)
            for source in self._sources
            for reason, count in source.inbox.rejected.items()
        )


class Teller:
    """Tells how a process is: a status message ten times a second, a line of log when its state changes."""

    def __init__(self, swarm: Swarm, identity: str, session: Session, refusals: Refusals) -> None:
        self._swarm, self._identity, self._session, self._refusals = swarm, identity, session, refusals
        self._vitals = Vitals()
        self._due = 0
        self._said = ""

    def due(self, now: int) -> bool:
        """Return whether it is time to tell."""
        return now >= self._due

    def tell(self, now: int, report: Report, counts: Deadlines, rejected: tuple[tuple[str, int], ...]) -> None:
        """Publish the status, and log the state if it is a new one."""
        self._due = now + STATUS_PERIOD
        self._session.publish(
            Key("status", self._identity),
            Status(
                now, self._swarm.frame, self._identity, report,
                counts.steps, counts.late_1ms, counts.late_5ms, counts.skipped,
                self._refusals.count, self._vitals.cpu_share(now), self._vitals.resident(),
                rejected, self._session.linked(),
            ),
        )  # fmt: skip
        said = f"{report.phase}: {report.detail}" if report.detail else str(report.phase)
        if said != self._said:
            self._said = said
            logging.getLogger(self._identity).info(said)


class Vitals:
    """What this process costs: its share of one core between two calls, and its memory."""

    def __init__(self) -> None:
        self._at, self._used = clock.now(), clock.cpu_time()

    def cpu_share(self, now: int) -> float:
        """Return the share of one core used since the last call."""
        used, elapsed = clock.cpu_time(), max(1, now - self._at)
        share = (used - self._used) * BILLION / elapsed
        self._at, self._used = now, used
        return share

    def resident(self) -> int:
        """Return the most memory that was resident so far, in bytes."""
        most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        return most if sys.platform == "darwin" else most * 1024


async def run_core(core: Core, swarm: Swarm, identity: str, keys: Path | None) -> None:
    """Fly `core` as `identity`, with the certificates in `keys`, until the process is told to end."""
    ended, refusals = ending(), Refusals(identity)
    refusals.watch()
    session = await connect(swarm, identity, keys, ended)
    if session is None:
        return
    with session:
        shell = Shell(core, swarm, identity, session, refusals)
        shell.start()
        try:
            await ended.wait()
        finally:
            shell.stop()


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


def main(identity: str, process: Coroutine[None, None, None]) -> int:
    """Run `process` as the process of `identity`; returns its exit status."""
    logging.basicConfig(
        level=logging.INFO,
        format="%(asctime)s.%(msecs)03d %(name)s: %(message)s",
        datefmt="%H:%M:%S",
        stream=sys.stderr,
    )
    try:
        asyncio.run(process)
    except (CredentialsError, EndpointInUseError) as error:
        logging.getLogger(identity).error(str(error))
        return 2
    return 0
