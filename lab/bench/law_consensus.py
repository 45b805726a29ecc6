"""A baseline: linear consensus on the places, `[control] law = "law_consensus:LinearConsensus"`.

W. Ren, R. W. Beard, E. M. Atkins, "Information consensus in multivehicle cooperative control", IEEE Control Systems
Magazine 27(2), 2007, pp. 71-82: single integrators with offsets from a common centre, here the leader:

    z_i = x_i − h_i,   u_i = h_i' − gamma sum_{j in N_i} w_ij (z_i − z_j),   z_0 = x_0

Each follower publishes z_i, where its own place puts the leader, as its estimate. For a leader that moves on at v the
law lags: in a chain with w = 1 follower k is k |v| / gamma behind its place.
"""

from __future__ import annotations

from flockwire_core.law import (
    RELAYING,
    ZERO,
    Decision,
    LawSettings,
    LeaderMotion,
    Observation,
    Parameters,
    Positive,
    add,
    scale,
    subtract,
)


class Gains(Parameters):
    """The gain gamma."""

    gain: Positive = 3.0  # 1/s


class LinearConsensus:
    """The law for one follower."""

    information = RELAYING
    Parameters = Gains

    def __init__(self, settings: LawSettings) -> None:
        self._gain = Gains.of(settings.parameters).gain
        self._offset = ZERO  # h_i, the last one

    def step(self, observation: Observation) -> Decision:
        """Return u_i and z_i; without a place the last h_i counts (zero at first), without a pose there is nothing."""
        motion, place = observation.motion, observation.place
        if motion is None:
            return Decision()
        if place is not None:
            self._offset = place.offset(observation.stamp)
        own = subtract(motion.position, self._offset)
        velocity = place.rate(observation.t) if place is not None else ZERO
        for one in observation.heard:
            velocity = add(velocity, scale(subtract(one.content.position, own), self._gain * one.weight))
        return Decision(velocity, LeaderMotion(own), stamp=observation.stamp)
