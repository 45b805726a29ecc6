"""The paper's law: observer (8) and protocol (9), as they are printed."""

from __future__ import annotations

from flockwire.control.observer import ObserverParameters, explicit_step, implicit_step, rate_estimate
from flockwire.control.protocol import ProtocolParameters, control_input
from flockwire.control.relay import LeaderMotion
from flockwire.control.vector import ZERO, Vector
from flockwire.flight.avoidance import repulsion
from flockwire.law import Decision, Observation
from flockwire.swarm.model import Swarm


class PaperLaw:
    """(8) and (9) for follower `number` of `swarm`."""

    def __init__(self, swarm: Swarm, number: int) -> None:
        control, observer = swarm.control, swarm.observer
        self._avoidance, self._time_constant = swarm.avoidance, observer.velocity_time_constant
        self._observe = implicit_step if observer.step == "implicit" else explicit_step
        self._observer = ObserverParameters(observer.gain, observer.exponent)
        self._protocol = ProtocolParameters(
            control.formation_gain, control.compensation_gain, control.compensation_smoothing
        )
        self._leader: Vector | None = None  # eta_i
        self._velocity = ZERO
        self._observed = 0  # the stamp of the newest estimate

    def step(self, observation: Observation, now: int) -> Decision:
        """One step of (8), then u_i of (9)."""
        leader = self._advance(observation)
        if leader is None:
            return Decision()
        self._observed = max(self._observed, observation.stamp if observation.motion is not None else now)
        return Decision(self._track(observation, leader), LeaderMotion(leader, self._velocity), self._observed)

    def _advance(self, observation: Observation) -> Vector | None:
        """One step of (8); the first guess is the own position, for want of a better one."""
        if self._leader is None:
            if observation.motion is None:
                return None
            self._leader = observation.motion.position
        previous = self._leader
        estimates = [(one.weight, one.motion.position) for one in observation.neighbour_estimates]
        self._leader = self._observe(previous, estimates, self._observer, observation.dt)
        if observation.dt > 0.0:
            self._velocity = rate_estimate(self._velocity, previous, self._leader, observation.dt, self._time_constant)
        return self._leader

    def _track(self, observation: Observation, leader: Vector) -> Vector:
        """Return u_i of (9) at the time of the pose."""
        if observation.motion is None or observation.reference is None:
            return ZERO
        offset, rate = observation.reference.offset(observation.stamp), observation.reference.rate(observation.stamp)
        push = repulsion(observation.bodies, self._avoidance)
        return control_input(observation.motion.position, offset, rate, leader, push, self._protocol)
