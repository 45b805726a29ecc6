"""The paper's law: observer (8) and protocol (9)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import ClassVar

from flockwire_core.compiling import mypyc_attr
from flockwire_core.control.observer import ObserverParameters, explicit_step, implicit_step, rate_estimate
from flockwire_core.control.potential import PotentialParameters, repulsion
from flockwire_core.control.protocol import ProtocolParameters, control_input
from flockwire_core.domain.motion import LeaderMotion
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import ZERO, Vector
from flockwire_core.law import RELAYING, Decision, Information, LawSettings, Observation, leader_of

from flockwire_agent.gains import PaperGains

ObserverStep = Callable[[Vector, Sequence[tuple[float, Vector]], ObserverParameters, float], Sequence[float]]


@mypyc_attr(allow_interpreted_subclasses=True)
class PaperLaw:
    """(8) and (9) for one follower; `observe` is a step of another observer, with the arguments of `implicit_step`."""

    information: ClassVar[Information] = RELAYING  # compiled, any other is an attribute of instances
    Parameters: ClassVar[type] = PaperGains

    def __init__(self, settings: LawSettings, observe: ObserverStep | None = None) -> None:
        gains = PaperGains.of(settings.parameters)
        self._gains = ObserverParameters(gains.observer_gain, gains.observer_exponent)
        self._observe = observe or (explicit_step if gains.observer_step == "explicit" else implicit_step)
        self._time_constant = gains.velocity_time_constant
        self._protocol = ProtocolParameters(gains.formation_gain, gains.compensation_gain, gains.compensation_smoothing)
        self._potentials = PotentialParameters(
            gains.drone_gain, gains.drone_influence_radius, gains.obstacle_gain, gains.obstacle_influence_radius
        )
        self._leader: Vector | None = None  # eta_i
        self._velocity = ZERO
        self._observed = 0  # the stamp of the newest estimate

    def step(self, observation: Observation) -> Decision:
        """One step of (8), then u_i of (9)."""
        leader = self._advance(observation)
        if leader is None:
            return Decision()
        self._observed = max(self._observed, observation.stamp if observation.motion is not None else observation.now)
        motion = LeaderMotion(leader, self._velocity)
        return Decision(self._track(observation, leader), motion, stamp=self._observed)

    def _advance(self, observation: Observation) -> Vector | None:
        """One step of (8); the first guess is the drone's own position."""
        if self._leader is None:
            if observation.motion is None:
                return None
            self._leader = observation.motion.position
        previous, dt = self._leader, observation.dt
        estimates = [(one.weight, leader_of(one).position) for one in observation.heard]
        x, y, z = self._observe(previous, estimates, self._gains, dt)
        self._leader = (float(x), float(y), float(z))  # another observer may return an array
        if dt > 0.0:
            self._velocity = rate_estimate(self._velocity, previous, self._leader, dt, self._time_constant)
        return self._leader

    def _track(self, observation: Observation, leader: Vector) -> Vector:
        """Return u_i of (9) at the time of the pose."""
        place = observation.place
        if observation.motion is None or place is None:
            return ZERO
        t = (observation.stamp - place.start) / SECOND
        offset, rate = place.offset(t), place.rate(t)
        push = repulsion(observation.bodies, self._potentials)
        return control_input(observation.motion.position, offset, rate, leader, push, self._protocol)
