"""The thin shell round every core: receive, step, publish, keep rate, report, end clean.

When to step, and what to count and to report, is the stepper's to decide (flight/stepping.py), here as in virtual time.
"""

from __future__ import annotations

import logging
from random import Random

from flockwire import clock
from flockwire.flight.cores import Core, Start, make_core
from flockwire.flight.faults import of_core
from flockwire.flight.stepping import StatusPublisher, Stepper, at_once, tick_period
from flockwire.runtime.detours import read_detours
from flockwire.runtime.ending import Ending, finished, last_resort
from flockwire.runtime.job import Job
from flockwire.runtime.refusals import Refusals
from flockwire.runtime.resources import ProcessResources
from flockwire.runtime.session import Session, connect
from flockwire.runtime.subscriptions import Prompt, Wakeup
from flockwire.runtime.ticker import Ticker
from flockwire.wire.plan import Plan


class Shell:
    """Runs one core on one session in the running loop."""

    def __init__(self, core: Core, plan: Plan, identity: str, session: Session, refusals: Refusals) -> None:
        self._running = False
        keys, prompt_keys, wakeup = plan.subscribes[identity], at_once(core), Wakeup(self._arrived)
        buffered = [session.newest(key) for key in keys if key not in prompt_keys]
        prompts = [session.prompt(key, wakeup) for key in keys if key in prompt_keys]
        status = status_publisher(plan, identity, session, refusals)
        self._stepper = Stepper(core, plan.swarm, buffered, [*buffered, *prompts], session.publish, status)
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


def status_publisher(plan: Plan, identity: str, session: Session, refusals: Refusals) -> StatusPublisher:
    """Return what publishes how this process is, on its session, and logs it."""
    resources = ProcessResources(session, refusals)
    return StatusPublisher(plan.swarm, identity, session.publish, resources, logging.getLogger(identity).info)


async def run_core(job: Job) -> None:
    """Run the core that the process table names until the process is to end."""
    plan, identity = job.plan, job.identity
    detours = read_detours()
    ending, refusals = Ending(), Refusals(identity)
    refusals.watch()
    session = await connect(plan, identity, job.keys, ending.told, detours)
    if session is None:
        return
    chance = Random(plan.swarm.gateway.seed)  # noqa: S311  (noise)
    core = make_core(Start(plan, identity, clock.now(), chance, of_core(job.faults, plan, identity), job.took_off))
    with session:
        shell = Shell(core, plan, identity, session, refusals)
        shell.start()
        try:
            await finished(core, plan, identity, session, ending)
        finally:
            shell.stop()
            last_resort()
