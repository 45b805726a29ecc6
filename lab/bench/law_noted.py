"""Laws whose velocities, before the filter, are noted for ways.py: the extended law, and with another planner."""

from __future__ import annotations

from flockwire_agent.extended_law import ExtendedLaw
from flockwire_core.domain.motion import Motion
from flockwire_core.domain.vector import ZERO, Vector, add, subtract
from flockwire_core.law import Decision, LawSettings, Observation
from flockwire_core.parameters import detour_parameters
from flockwire_core.swarm.model import uav
from tangent_planner import Planner

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


class Planned(Noted):
    """The same, but ways round by the tangent graph: a candidate, not yet as good where gaps are one drone wide."""

    def __init__(self, settings: LawSettings) -> None:
        super().__init__(settings)
        self._planner = Planner(detour_parameters(settings.guard), settings.number)

    def _around(self, observation: Observation, motion: Motion, forward: Vector, error: Vector, now: float) -> Vector:
        place = subtract(motion.stopping, error)
        offset, rate = self._bent.update(place, forward, motion.position, observation.bodies, observation.dt)
        if offset != ZERO:
            error, forward = subtract(error, offset), add(forward, rate)
        return add(forward, self._planner.correction(error, motion, forward, observation.bodies, self._gain, now))
