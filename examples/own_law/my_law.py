"""A control law with an integral part: u = h' - K e - I, I' = K_I e, with e = x - h - eta.

It does not know the leader's velocity: without the integral part e would be about that velocity divided by K.
"""

from __future__ import annotations

from flockwire.law import (
    RELAYING,
    SECOND,
    ZERO,
    Decision,
    LawSettings,
    LeaderMotion,
    NotNegative,
    Observation,
    Parameters,
    Positive,
    Vector,
    add,
    limit,
    norm,
    scale,
    subtract,
)


class Gains(Parameters):
    """The keys of [control.parameters]."""

    gain: Positive = 1.5  # K, 1/s
    integral_gain: NotNegative = 0.4  # K_I, 1/s^2
    integral_limit: Positive = 0.3  # m/s, of I
    reach: Positive = 0.3  # m: farther from the place, I does not change


class Integrating:
    """Average the neighbours' estimates of the leader; fly to the place beside it with an integral part."""

    information = RELAYING
    Parameters = Gains

    def __init__(self, settings: LawSettings) -> None:
        self.gains = Gains.of(settings.parameters)
        self.leader: LeaderMotion | None = None
        self.integral: Vector = ZERO

    def step(self, observation: Observation) -> Decision:
        """Return the velocity, and the estimate for the out-neighbours."""
        estimates = observation.heard
        total = sum(one.weight for one in estimates)
        if total:
            mean = ZERO
            for one in estimates:
                ahead = one.content.after((observation.now - one.stamp) / SECOND).position
                mean = add(mean, scale(ahead, one.weight / total))
            self.leader = LeaderMotion(mean)
        place, motion = observation.place, observation.motion
        if self.leader is None or motion is None or place is None:
            self.integral = ZERO
            return Decision(message=self.leader)
        error = subtract(subtract(motion.position, place.offset(observation.t)), self.leader.position)
        if norm(error) < self.gains.reach:
            step = scale(error, self.gains.integral_gain * observation.dt)
            self.integral = limit(add(self.integral, step), self.gains.integral_limit)
        feedback = add(scale(error, self.gains.gain), self.integral)
        return Decision(subtract(place.rate(observation.t), feedback), self.leader)
