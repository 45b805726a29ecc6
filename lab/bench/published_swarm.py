"""Publishes for all members of a swarm from one process, each by its own session and certificate (console.py)."""

from __future__ import annotations

import contextlib
import multiprocessing
import time
from collections.abc import Callable, Iterator
from itertools import cycle
from math import cos, sin
from pathlib import Path
from typing import Any

from flockwire_core import clock
from flockwire_core.domain.airframe import FlightState, Telemetry
from flockwire_core.domain.order import Mission
from flockwire_core.domain.time import SECOND
from flockwire_core.loading import load_swarm
from flockwire_core.runtime.session import Session
from flockwire_core.wire.codec import Message
from flockwire_core.wire.keys import Key
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.status import Report, Status

PERIOD = 0.1  # s
KINDS = ("status", "telemetry")  # of keys: what observers receive


def observed(plan: Plan, identities: tuple[str, ...]) -> list[tuple[str, Key]]:
    """Return the keys by which observers learn of `identities`, each with who publishes it."""
    return [(one, key) for one in identities for key in plan.publishes[one] if key.kind in KINDS]


class PublishedSwarm:
    """Makes what `identities` say of themselves, as in a formation flight that began when this was made."""

    def __init__(self, plan: Plan, identities: tuple[str, ...]) -> None:
        self._plan, self._begin = plan, clock.now()
        self._mission = Mission(self._begin, plan.swarm.frame, "start", self._begin)
        self.makers = [(one, key, self._maker(one, key)) for one, key in observed(plan, identities)]

    def _maker(self, identity: str, key: Key) -> Callable[[], Message]:
        frame, drone = self._plan.swarm.frame, self._plan.members[identity].drone
        if key.kind == "telemetry":
            return lambda: Telemetry(clock.now(), frame, FlightState.FLYING, 0.8, 1.0, 0.004)
        if drone is None:
            return lambda: self._status(identity, Report("running"))
        return lambda: self._status(identity, self._report(drone))

    def _report(self, drone: int) -> Report:
        x, y, _ = self._plan.swarm.drone(drone).start
        angle = 0.4 * (clock.now() - self._begin) / SECOND
        place = (x + 0.35 * cos(angle), y + 0.35 * sin(angle), 1.0)
        return Report("formation", "", 0.0123, 0.011, 0.013, 0.012, 0.08, 0.8, self._mission, position=place)

    def _status(self, identity: str, report: Report) -> Status:
        rejected = ((f"{self._plan.swarm.name}/uav1/pose older than the last", 3),)
        links, frame = self._plan.partners[identity], self._plan.swarm.frame
        return Status(clock.now(), frame, identity, report, 4711, 9, 1, 0, 0, 0.07, 45 << 20, rejected, links)


def publish(file: Path, keys: Path, identities: tuple[str, ...], count: Any) -> None:  # noqa: ANN401  (shared memory)
    """Publish each key every PERIOD s, at a moment of its own, until the process is killed; count what went out."""
    plan = Plan(load_swarm(file))
    makers = PublishedSwarm(plan, identities).makers
    with contextlib.ExitStack() as stack:
        sessions = {one: stack.enter_context(Session(plan, one, keys, verified=False)) for one in identities}
        due = time.monotonic()
        for identity, key, make in cycle(makers):
            due += PERIOD / len(makers)
            time.sleep(max(0.0, due - time.monotonic()))
            sessions[identity].publish([(key, make())])
            count.value += 1


@contextlib.contextmanager
def publishing(file: Path, keys: Path, identities: tuple[str, ...]) -> Iterator[Any]:
    """Publish for `identities` as long as the context lasts; yields how many messages went out (`.value`)."""
    context = multiprocessing.get_context("spawn")
    count = context.Value("q", 0)
    process = context.Process(target=publish, args=(file, keys, identities, count))
    process.start()
    try:
        yield count
    finally:
        process.kill()
        process.join()
