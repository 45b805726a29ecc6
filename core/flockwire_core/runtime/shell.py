"""The thin shell around every core: receive, step, publish, keep rate, report, end.

The stepper decides when to step, and what to count and report (process/stepping.py), as in virtual time.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractAsyncContextManager, nullcontext
from random import Random

from flockwire_core import clock
from flockwire_core.law import Law
from flockwire_core.process.cores import Core, Start, Stopwatch
from flockwire_core.process.stepping import StatusPublisher, StepCounts, Stepper, prompt_keys, tick_period
from flockwire_core.process.timekeeping import patience
from flockwire_core.runtime.ending import Ending, last_resort, wait_for_end
from flockwire_core.runtime.job import FileStore, Job, connect_job
from flockwire_core.runtime.refusals import Refusals
from flockwire_core.runtime.reporting import status_publisher
from flockwire_core.runtime.samples import Prompt, Wakeup
from flockwire_core.runtime.session import Session
from flockwire_core.runtime.swarm_clock import SwarmClock
from flockwire_core.runtime.ticker import Ticker
from flockwire_core.security.files import default_folder
from flockwire_core.swarm.model import Swarm
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.status import Report

Feed = Callable[[Core, "Shell"], AbstractAsyncContextManager[None] | None]
"""Opens an input that is no key, for the core of a shell; None if it has none."""


class Shell:
    """Runs one core on one session, in the running loop and where it may on the thread on which Zenoh receives."""

    def __init__(self, core: Core, session: Session, swarm_clock: SwarmClock, status: StatusPublisher) -> None:
        self._running, self._lock = False, swarm_clock.lock
        timed, wakeup = swarm_clock.timekeeping, Wakeup(self._arrived, swarm_clock.lock)
        keys, prompt = session.plan.subscribes[session.identity], prompt_keys(core)
        keys = tuple([key for key in keys if key not in timed.keys])
        buffered = [session.buffered(key) for key in keys if key not in prompt]
        prompts = [session.prompt(key, wakeup) for key in keys if key in prompt]
        self._wakeup = wakeup
        inputs = [*buffered, *prompts, *swarm_clock.prompts]
        self.stepper = Stepper(core, session.plan.swarm.name, buffered, inputs, session.publish, timed, status)
        self._ticker = Ticker(tick_period(core), self._tick, swarm_clock.lock)

    def start(self, direct: bool = False) -> None:
        """Begin; `direct`: the core's inputs are keys alone, so that it may step on Zenoh's thread."""
        self._ticker.start()
        self._running, self._wakeup.direct = True, direct

    def stop(self) -> None:
        """Stop stepping; later announcements of Zenoh's threads are ignored."""
        with self._lock:
            self._running = self._wakeup.direct = False
        self._ticker.stop()

    def step(self) -> None:
        """Step for input that arrived by another way than the session."""
        with self._lock:
            if self._running:
                self.stepper.step_on_external_input(clock.now())

    def _arrived(self, prompt: Prompt) -> None:
        if self._running:
            self.stepper.arrived(prompt, clock.now())

    def _tick(self, lateness: int, skipped: int) -> None:
        self.stepper.tick(lateness, skipped, clock.now())


def _waits(status: StatusPublisher) -> None:
    """Publish, at its time, that the process has no core yet."""
    now = clock.now()
    if status.due(now):
        status.update(now, Report(Phase.WAITING, "waits for the gateway's time"), StepCounts(), ())


def prompt_law(swarm: Swarm, number: int) -> Law:
    """Return the law of a follower in real time: one in another process has half a period for a step."""
    from flockwire_core.follower_law import follower_law  # noqa: PLC0415  (few processes have a law)

    return follower_law(swarm, number, 0.5 / swarm.control.rate_hz)


async def run_core(job: Job, feed: Feed | None = None) -> None:
    """Run the core of the process table, with its own input, until the process must end."""
    plan, identity = job.plan, job.identity
    ending, refusals = Ending(), Refusals(identity)
    refusals.watch()
    session = await connect_job(job, ending.ended)
    if session is None:
        return
    with session:
        swarm_clock = SwarmClock(plan, identity, session)
        loop = asyncio.get_running_loop()
        status = status_publisher(session, refusals, swarm_clock.timekeeping, loop)
        await swarm_clock.wait_for_time(ending.ended, patience(plan, identity), lambda: _waits(status))
        chance = Random(plan.swarm.gateway.seed)  # noqa: S311  (noise)
        status.stopwatch = Stopwatch(clock.monotonic, 1.0 / plan.swarm.control.rate_hz)
        store = FileStore((job.keys or default_folder(plan.swarm.name)) / f"{identity}.kept")
        aside = ThreadPoolExecutor(1, "aside").submit  # starts a thread with its first task
        core = job.make_core(Start(plan, identity, clock.now(), chance, status.stopwatch, store, aside, prompt_law))
        shell = Shell(core, session, swarm_clock, status)
        fed = feed(core, shell) if feed is not None else None
        shell.start(direct=fed is None)
        with last_resort(identity, shell.stop):
            async with fed or nullcontext():
                await wait_for_end(core, session, ending, swarm_clock.lock, shell.stepper.time)
