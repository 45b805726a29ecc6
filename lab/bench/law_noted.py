"""The extended law, whose planned directions ways.py compares with what is flown."""

from __future__ import annotations

from math import hypot

from flockwire_agent.extended_law import ExtendedLaw
from flockwire_agent.gains import ExtendedGains
from flockwire_core.domain.vector import ZERO, Vector, add, subtract
from flockwire_core.law import Decision, LawSettings, Observation
from flockwire_core.swarm.model import uav

BACKWARDS = 0.3  # m against its planned way from which on a drone turns back

PLANNED: dict[str, Vector] = {}  # of each follower, relative to its place; zero where BACKWARDS or less is left of it


class Noted(ExtendedLaw):
    """The extended law, whose planned direction is noted."""

    def __init__(self, settings: LawSettings) -> None:
        super().__init__(settings)
        self._owner = uav(settings.number)
        gain, most = ExtendedGains.of(settings.parameters).formation_gain, settings.guard.speed
        self._least = min(gain * BACKWARDS, 0.95 * most)  # m/s

    def step(self, observation: Observation) -> Decision:
        """Note the direction of the step."""
        decision, place = super().step(observation), observation.place
        if place is not None and decision.message is not None:
            rate = add(place.rate(observation.t), decision.message.velocity)
            x, y, _ = subtract(decision.command, rate)
            length = hypot(x, y)
            PLANNED[self._owner] = (x / length, y / length, 0.0) if length > self._least else ZERO
        return decision
