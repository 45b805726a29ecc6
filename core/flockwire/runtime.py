"""The thin shell round every core: receive, step, publish, keep rate, tell how it is, end clean.

When to step, and what to count and to tell, is the stepper's to decide (stepping.py), here as in virtual time.
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
from collections.abc import Coroutine
from pathlib import Path
from typing import TYPE_CHECKING

from flockwire import clock, policy
from flockwire.credentials import CredentialsError
from flockwire.detours import DetoursError, read_detours
from flockwire.nanoseconds import BILLION
from flockwire.refusals import Refusals
from flockwire.session import EndpointInUseError, Session, connect
from flockwire.sources import Prompt
from flockwire.stepping import Core, Deadlines, StatusTeller, Stepper, at_once, tick_period
from flockwire.ticker import Ticker

if TYPE_CHECKING:
    from flockwire.config import Swarm

__all__ = ["LIFELINE", "Core", "Deadlines", "Shell", "ending", "main", "make_teller", "run_core"]

LIFELINE = "FLOCKWIRE_LIFELINE"  # file descriptor whose end means that the parent is gone
LAST_RESORT = 1.8  # s after the signal to end at which a process ends in any case


class Shell:
    """Runs one core on one session in the running loop."""

    def __init__(self, core: Core, swarm: Swarm, identity: str, session: Session, refusals: Refusals) -> None:
        self._running = False
        heard, prompt_keys = policy.hears(swarm, identity), at_once(core)
        resting = [session.newest(key) for key in heard if key not in prompt_keys]
        prompts = [session.prompt(key, self._arrived) for key in heard if key in prompt_keys]
        teller = make_teller(swarm, identity, session, refusals)
        self._stepper = Stepper(core, swarm, resting, [*resting, *prompts], session.publish, teller)
        self._ticker = Ticker(tick_period(core), self._tick)

    def start(self) -> None:
        """Begin."""
        self._running = True
        self._ticker.start()

    def stop(self) -> None:
        """Step no more; what Zenoh's threads still announce is left alone."""
        self._running = False
        self._ticker.stop()

    def _arrived(self, prompt: Prompt) -> None:
        if self._running:
            self._stepper.arrived(prompt, clock.now())

    def _tick(self, lateness: int, skipped: int) -> None:
        self._stepper.tick(lateness, skipped, clock.now())


def make_teller(swarm: Swarm, identity: str, session: Session, refusals: Refusals) -> StatusTeller:
    """Return what tells how this process is, on its session and in its log."""
    return StatusTeller(swarm, identity, session.publish, Vitals(session, refusals), logging.getLogger(identity).info)


class Vitals:
    """What this process costs, and how it is connected."""

    def __init__(self, session: Session, refusals: Refusals) -> None:
        self._session, self._refusals = session, refusals
        self._links: tuple[str, ...] = ()
        self._look_at = 0
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

    def refused(self) -> int:
        """Return the connections refused so far."""
        return self._refusals.count

    def links(self) -> tuple[str, ...]:
        """Return who is linked, by authenticated identity, as of a second ago at most: to look takes a while."""
        now = clock.monotonic()
        if now >= self._look_at:
            self._look_at, self._links = now + BILLION, self._session.linked()
        return self._links


async def run_core(core: Core, swarm: Swarm, identity: str, keys: Path | None) -> None:
    """Fly `core` as `identity`, with the certificates in `keys`, until the process is told to end."""
    detours = read_detours()
    ended, refusals = ending(), Refusals(identity)
    refusals.watch()
    session = await connect(swarm, identity, keys, ended, detours)
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
    except (CredentialsError, DetoursError, EndpointInUseError) as error:
        logging.getLogger(identity).error(str(error))
        return 2
    return 0
