"""The extended law, of which ways.py notes what it wanted, and what the safety filter makes of that in parts."""

from __future__ import annotations

from math import hypot
from typing import NamedTuple

from flockwire_agent.extended_law import ExtendedLaw
from flockwire_agent.gains import ExtendedGains
from flockwire_core.control.around.planner import SLOW
from flockwire_core.control.guard import Guard
from flockwire_core.domain.body import Body, BodyKind, stands
from flockwire_core.domain.vector import ZERO, Vector, add, subtract
from flockwire_core.law import Decision, LawSettings, Observation
from flockwire_core.swarm.model import uav

EVERY = 5  # steps of which one is noted
BACKWARDS = 0.3  # m against its planned way from which on a drone turns back


class Note(NamedTuple):
    """One step: velocities, m/s."""

    wanted: Vector  # by the law
    limited: Vector  # of this, by the filter's limits of speed and acceleration and the room
    fixed: Vector  # by the filter for what is fixed, or stands, alone
    way: Vector  # the planned direction relative to the place, zero where BACKWARDS or less is left of it


NOTED: dict[str, Note] = {}  # the step of each follower, if it is noted
SENT: dict[str, Vector] = {}  # m/s, its last command, which ways.py receives


class Noted(ExtendedLaw):
    """The extended law, whose velocities are noted."""

    def __init__(self, settings: LawSettings) -> None:
        super().__init__(settings)
        self._owner, self._guard, self._most = uav(settings.number), Guard(settings.guard), settings.guard.speed
        self._least = min(ExtendedGains.of(settings.parameters).formation_gain * BACKWARDS, 0.95 * self._most)  # m/s
        self._steps = 0

    def step(self, observation: Observation) -> Decision:
        """Note the velocities of the step."""
        decision = super().step(observation)
        seen, place, motion, self._steps = observation, observation.place, observation.motion, self._steps + 1
        NOTED.pop(self._owner, None)
        if place is None or motion is None or decision.message is None or self._steps % EVERY:
            return decision
        rate = add(place.rate(seen.t), decision.message.velocity)
        bodies = self._guard.tracked(motion, seen.bodies, seen.stamp)
        still = [body for body in bodies if _is_still(body, rate)]
        last, guard = SENT.get(self._owner, ZERO), self._guard
        limited, fixed = (
            guard.velocity(decision.command, motion, some, seen.stamp, seen.now, last, seen.dt, self._most, False)
            for some in ((), still)
        )
        x, y, _ = subtract(decision.command, rate)
        length = hypot(x, y)
        way = (x / length, y / length, 0.0) if length > self._least else ZERO
        NOTED[self._owner] = Note(decision.command, limited, fixed, way)
        return decision


def _is_still(body: Body, rate: Vector) -> bool:
    if body.kind is BodyKind.DRONE:
        return hypot(body.velocity[0] - rate[0], body.velocity[1] - rate[1]) < SLOW
    return stands(body)
