"""The extended law: the observer relays the leader's motion, the protocol leads the airframe's lag and dead time.

    u_i = u_r − K (y − y_r),   r = h_i + eta_i,   u_r = r'(t + D) + lag r''(t + D),   y_r = r(t + D) + lag r'(t + D)

y is the airframe's stopping point. The safety filter around the law, not a potential, keeps the drones apart.
"""

from __future__ import annotations

from typing import ClassVar

from flockwire_core.compiling import mypyc_attr
from flockwire_core.control.airframe.first_order_lag import lead
from flockwire_core.control.around.planner import Planner
from flockwire_core.control.leader_track import LeaderTrack
from flockwire_core.control.observer import ObserverParameters, relay_step
from flockwire_core.domain.motion import LeaderMotion
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import ZERO, Vector, add, scale, subtract
from flockwire_core.law import RELAYING, Decision, Heard, Information, LawSettings, Observation, Place, leader_of

from flockwire_agent.gains import ExtendedGains


@mypyc_attr(allow_interpreted_subclasses=True)
class ExtendedLaw:
    """The extended law for one follower."""

    information: ClassVar[Information] = RELAYING  # compiled, any other is an attribute of instances
    Parameters: ClassVar[type] = ExtendedGains

    def __init__(self, settings: LawSettings) -> None:
        gains = ExtendedGains.of(settings.parameters)
        self._gain = gains.formation_gain
        self._lag, self._dead_time, self._hold = settings.lag, settings.dead_time, settings.period
        self._period = round(self._hold * SECOND)
        self._observer = ObserverParameters(gains.observer_gain, gains.observer_exponent)
        self._time_constant = gains.leader_time_constant
        self._track = LeaderTrack(self._time_constant)
        self._waits, self._start = True, 0  # without a place in a formation; time 0 of the last one
        self._leader: LeaderMotion | None = None
        self._epoch = 0  # Unix ns, time 0 of the trackers
        self._planner = Planner(settings.guard, self._gain, settings.number)

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
        correction = self._planner.correction(error, observation.motion, forward, observation.bodies, seconds)
        return Decision(add(forward, correction), leader)

    def _begin(self, place: Place | None) -> None:
        """Forget the leader's motion as a formation begins: the end of its take-off would count for 3 T as a fall."""
        if place is not None and self._waits and place.start != self._start:
            self._track, self._start = LeaderTrack(self._time_constant), place.start
        self._waits = place is None

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
        error = subtract(observation.motion.stopping, lead(goal, add(before, there.velocity), self._lag))
        # The command lasts one period, so it is evaluated at the middle of the period.
        rate = add(scale(add(before, after), 0.5), leader.after(self._dead_time + 0.5 * self._hold).velocity)
        turn = add(scale(subtract(after, before), 1.0 / self._hold), there.acceleration)
        return lead(rate, turn, self._lag), error
