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

    def step(self, seen: Observation, now: int) -> Decision:
        """One step of (8), then u_i of (9)."""
        leader = self._advance(seen)
        if leader is None:
            return Decision()
        self._observed = max(self._observed, seen.stamp if seen.motion is not None else now)
        return Decision(self._track(seen, leader), LeaderMotion(leader, self._velocity), self._observed)

    def _advance(self, seen: Observation) -> Vector | None:
        """One step of (8); the first guess is the own position, for want of a better one."""
        if self._leader is None:
            if seen.motion is None:
                return None
            self._leader = seen.motion.position
        previous = self._leader
        heard = [(one.weight, one.motion.position) for one in seen.heard]
        self._leader = self._observe(previous, heard, self._observer, seen.dt)
        if seen.dt > 0.0:
            self._velocity = rate_estimate(self._velocity, previous, self._leader, seen.dt, self._time_constant)
        return self._leader

    def _track(self, seen: Observation, leader: Vector) -> Vector:
        """Return u_i of (9) at the time of the pose."""
        if seen.motion is None or seen.reference is None:
            return ZERO
        offset, rate = seen.reference.offset(seen.stamp), seen.reference.rate(seen.stamp)
        push = repulsion(seen.bodies, self._avoidance)
        return control_input(seen.motion.position, offset, rate, leader, push, self._protocol)
