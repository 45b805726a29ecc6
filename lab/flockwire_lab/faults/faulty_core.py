"""Wraps a core with the faults of a flight, the same in real and virtual time; the core knows nothing of it."""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from typing import Any, cast

from flockwire_core.domain.airframe import Command
from flockwire_core.domain.order import Mission
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND
from flockwire_core.process.cores import Core, Framed
from flockwire_core.swarm.model import uav
from flockwire_core.wire.codec import Message
from flockwire_core.wire.keys import Key
from flockwire_core.wire.plan import Plan

from flockwire_lab.faults.kinds import Fault


class FaultyCore:
    """Edits what a core receives and sends by `faults`, and changes the conditions of what it simulates.

    All else is the core's own.

    Times count from `took_off` (Unix ns) or, without it, from what the core learns of the take-off: the order, the
    first climb command, or a drone in the air.
    """

    def __init__(self, core: Core, faults: Sequence[Fault], plan: Plan, took_off: int | None) -> None:
        airborne = 0.02  # m above the highest start at which a drone has taken off
        self._core, self._faults, self._took_off = core, faults, took_off
        self._stand_in: Any = getattr(core, "source", core)  # what has conditions
        self._usual = getattr(self._stand_in, "conditions", None)
        swarm = plan.swarm
        self._highest = airborne + max((swarm.drone(i).start[2] for i in swarm.flying), default=0.0)
        self._walking = frozenset(map(uav, swarm.walking))
        self._edits: dict[Key, list[Fault]] = {}  # what edits the messages of a key
        for fault in faults:
            fault.prepare(self._stand_in)
            for kind in fault.edits:
                for drone in {*fault.named_drones().values()}:
                    self._edits.setdefault(Key(kind, uav(drone)), []).append(fault)
        for name in ("sockets", "datagram", "outgoing", "due"):  # it is Networked or Framed if the core is
            if hasattr(core, name):
                setattr(self, name, getattr(core, name))

    def receive(self, key: Key, message: Message, now: int) -> None:
        """Receive a message, edited."""
        if self._took_off is None:
            self._took_off = self._takeoff(key, message, now)
        edited: Message | None = message
        if key.kind == "truth":
            self._change(message.stamp)
            edited = self._edited(key, message, message.stamp)
        if edited is not None:
            self._core.receive(key, edited, now)

    def step(self, now: int) -> list[tuple[Key, Message]]:
        """Return what the core publishes, edited."""
        if not isinstance(self._core, Framed):  # the conditions of a frame are those of its capture
            self._change(now)
        messages = list(self._core.step(now))
        if self._took_off is None and getattr(self._core, "flies", False):
            self._took_off = now
        edited = ((key, self._edited(key, message, now)) for key, message in messages)
        return [(key, message) for key, message in edited if message is not None]

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401  (whatever the core has)
        return getattr(self._core, name)

    def _takeoff(self, key: Key, message: Message, now: int) -> int | None:
        match message:
            case Mission() if message.verb == "takeoff":
                return message.stamp
            case Command() if message.velocity[2] > 0.0:
                return now
            case Pose() if key.kind == "truth" and message.position[2] > self._highest:
                return None if key.owner in self._walking else message.stamp
        return None

    def _active(self, faults: Sequence[Fault], at: int) -> list[tuple[Fault, float]]:
        """Return those of `faults` that act at `at` (Unix ns), each with the s since it began."""
        if self._took_off is None:
            return []
        t = (at - self._took_off) / SECOND
        return [(fault, t - fault.at) for fault in faults if 0.0 <= t - fault.at < fault.lasts]

    def _edited(self, key: Key, message: Message, at: int) -> Message | None:
        """Return `message` as the faults that act at `at` (Unix ns) make it; None: it is lost."""
        edited: Any = message  # of the kind that the faults edit
        for fault, since in self._active(self._edits.get(key, ()), at):
            if edited is not None:
                edited = fault.edit(edited, since, at)
        return cast("Message | None", edited)

    def _change(self, at: int) -> None:
        """Set the conditions of what the core simulates to those at `at` (Unix ns)."""
        if self._usual is not None:
            active = self._active(self._faults, at)
            self._stand_in.conditions = reduce(lambda c, one: one[0].change(c, one[1]), active, self._usual)


def faulty(core: Core, faults: Sequence[Fault], plan: Plan, identity: str, took_off: int | None) -> Core:
    """Return the core of `identity` as those of `faults` that it is subject to make it."""
    row, drone = plan.rows[identity], plan.members[identity].drone
    own = [one for one in faults if row in one.cores and (drone is None or drone in one.named_drones().values())]
    return cast("Core", FaultyCore(core, own, plan, took_off)) if own else core
