"""The extended law: the observer relays the leader's motion, the protocol leads the airframe's lag and dead time.

    u_i = u_r − K (y − y_r),   r = h_i + eta_i,   u_r = r'(t + D) + lag r''(t + D),   y_r = r(t + D) + lag r'(t + D)

y is the airframe's stopping point. The safety filter around the law, not a potential, keeps the drones apart.
"""

from __future__ import annotations

from typing import ClassVar

from flockwire_core.compiling import mypyc_attr
from flockwire_core.control.airframe.first_order_lag import lead, stopping_reference
from flockwire_core.control.around.bent_place import BentPlace
from flockwire_core.control.around.sidestep import Sidestep, SidestepParameters
from flockwire_core.control.around.way_of_mover import WayOfMover
from flockwire_core.control.around.way_round import WayRound
from flockwire_core.control.leader_track import LeaderTrack
from flockwire_core.control.observer import ObserverParameters, relay_step
from flockwire_core.domain.motion import LeaderMotion, Motion
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import ZERO, Vector, add, limit, norm, scale, subtract
from flockwire_core.law import RELAYING, Decision, Heard, Information, LawSettings, Observation, Place, leader_of
from flockwire_core.parameters import detour_parameters

from flockwire_agent.gains import ExtendedGains

SIDE_SWITCH_TIME = 3.0  # s without progress after which a drone changes the side; each drone adds its own share


@mypyc_attr(allow_interpreted_subclasses=True)
class ExtendedLaw:
    """The extended law for one follower."""

    information: ClassVar[Information] = RELAYING  # compiled, any other is an attribute of instances
    Parameters: ClassVar[type] = ExtendedGains

    def __init__(self, settings: LawSettings) -> None:
        gains, detour = ExtendedGains.of(settings.parameters), detour_parameters(settings.guard)
        self._gain, self._speed = gains.formation_gain, settings.speed
        self._lag, self._dead_time, self._hold = settings.lag, settings.dead_time, settings.period
        self._period = round(self._hold * SECOND)
        self._observer = ObserverParameters(gains.observer_gain, gains.observer_exponent)
        self._time_constant = gains.leader_time_constant
        self._track = LeaderTrack(self._time_constant)
        self._waits, self._start = True, 0  # without a place in a formation; time 0 of the last one
        self._leader: LeaderMotion | None = None
        self._epoch = 0  # Unix ns, time 0 of the trackers
        patience = SIDE_SWITCH_TIME * (1.0 + (settings.number * 0.618) % 1.0)
        self._bent = BentPlace(detour)
        self._way = WayRound(detour, 0.5 * patience)
        self._mover = WayOfMover(detour)
        self._sidestep = Sidestep(SidestepParameters(gains.safety_distances, gains.sidestep_reach), patience)

    def step(self, observation: Observation) -> Decision:
        """Relay the leader's motion, then track the place in the formation."""
        now = observation.now
        self._epoch = self._epoch or now
        self._begin(observation.place)
        leader = self._observe(observation, now)
        if leader is None:
            return Decision()
        if observation.motion is None or observation.place is None:
            return Decision(ZERO, leader)
        forward, error = self._tracking(observation, leader, observation.place, now)
        seconds = (now - self._epoch) / SECOND
        return Decision(self._around(observation, observation.motion, forward, error, seconds), leader)

    def _begin(self, place: Place | None) -> None:
        """Forget the leader's motion as a formation begins: the end of its take-off would count for 3 T as a fall."""
        if place is not None and self._waits and place.start != self._start:
            self._track, self._start = LeaderTrack(self._time_constant), place.start
        self._waits = place is None

    def _around(self, observation: Observation, motion: Motion, forward: Vector, error: Vector, now: float) -> Vector:
        """Return u_r − K (y − y_r), m/s, with the place bent and the correction turned round bodies; `now` in s."""
        bodies, place = observation.bodies, subtract(motion.stopping, error)
        offset, rate = self._bent.update(place, forward, motion.position, bodies, observation.dt)
        if offset != ZERO:
            error, forward = subtract(error, offset), add(forward, rate)
        correction = limit(scale(error, -self._gain), self._speed)
        if bodies:
            to_go = (-error[0], -error[1])
            correction, bodies = self._way.turned(correction, motion, forward, to_go, bodies, now)
        wanted = add(forward, self._sidestep.turned(correction, bodies, norm(error), now, forward))
        if not bodies:
            return wanted
        return self._mover.left(wanted, error, bodies, subtract(motion.stopping, motion.position))

    def _observe(self, observation: Observation, now: int) -> LeaderMotion | None:
        estimates = [(one.weight, self._motion(one).after((now - one.stamp) / SECOND)) for one in observation.heard]
        if self._leader is None:
            if not estimates:
                return None
            self._leader = estimates[0][1]
        self._leader = relay_step(self._leader, estimates, self._observer, observation.dt)
        return self._leader

    def _motion(self, estimate: Heard) -> LeaderMotion:
        if not estimate.leads:
            return leader_of(estimate)
        return self._track.update(leader_of(estimate).position, (estimate.stamp - self._epoch) / SECOND)

    def _tracking(
        self, observation: Observation, leader: LeaderMotion, place: Place, now: int
    ) -> tuple[Vector, Vector]:
        """Return the feed-forward u_r and the error y − y_r."""
        assert observation.motion is not None  # noqa: S101  (the caller looked)
        ahead = now + round(self._dead_time * SECOND)
        t = (ahead - place.start) / SECOND
        before, after = place.rate(t), place.rate((ahead + self._period - place.start) / SECOND)
        there = leader.after(self._dead_time)
        goal = add(place.offset(t), there.position)
        error = subtract(observation.motion.stopping, stopping_reference(goal, add(before, there.velocity), self._lag))
        # The command lasts one period, so it is evaluated at the middle of the period.
        rate = add(scale(add(before, after), 0.5), leader.after(self._dead_time + 0.5 * self._hold).velocity)
        turn = add(scale(subtract(after, before), 1.0 / self._hold), there.acceleration)
        return lead(rate, turn, self._lag), error
