"""The extended law, whose velocities before the filter are noted for ways.py."""

from __future__ import annotations

from flockwire_agent.extended_law import ExtendedLaw
from flockwire_core.domain.vector import Vector
from flockwire_core.law import Decision, LawSettings, Observation
from flockwire_core.swarm.model import uav

WANTED: dict[str, Vector] = {}  # m/s, by the law of each follower


class Noted(ExtendedLaw):
    """The extended law, of which the velocities are noted."""

    def __init__(self, settings: LawSettings) -> None:
        super().__init__(settings)
        self._owner = uav(settings.number)

    def step(self, observation: Observation) -> Decision:
        """Note the velocity of the step."""
        decision = super().step(observation)
        WANTED[self._owner] = decision.command
        return decision
