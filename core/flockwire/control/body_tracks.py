"""Velocities of nearby bodies: positions without identities, matched from one message to the next."""

from __future__ import annotations

from collections.abc import Sequence
from math import dist

from flockwire.control.tracker import VelocityTracker
from flockwire.control.vector import Vector

GATE = 0.3  # m: a body farther than this from where every known one should be is a new one


class BodyTracks:
    """Follows bodies by position alone: each new position belongs to the track whose prediction is nearest.

    `time_constant` (s) is that of the trackers. The bodies of one call keep their order in its result.
    """

    def __init__(self, time_constant: float) -> None:
        self._time_constant = time_constant
        self._tracks: list[VelocityTracker] = []
        self._stamp = 0.0

    def update(self, positions: Sequence[Vector], stamp: float) -> list[Vector]:
        """Return the velocity, m/s, of each of `positions` (m, world frame) seen at `stamp` (s); 0 for a new body."""
        if stamp < self._stamp:  # of a clock that was set back
            self._tracks = []
        if stamp > self._stamp or len(positions) != len(self._tracks):
            self._match(positions, stamp)
            self._stamp = stamp
        return [track.velocity for track in self._tracks]

    def _match(self, positions: Sequence[Vector], stamp: float) -> None:
        """Give each position its track; the place that a body had in the order is looked at first."""
        predicted = [_ahead(track, stamp) for track in self._tracks]
        free = set(range(len(predicted)))
        tracks: list[VelocityTracker] = []
        for place, position in enumerate(positions):
            best = place if place in free and dist(predicted[place], position) < 0.1 * GATE else None
            if best is None:
                best = min(free, key=lambda k: dist(predicted[k], position), default=None)
                if best is not None and dist(predicted[best], position) > GATE:
                    best = None
            if best is None:
                tracks.append(VelocityTracker(self._time_constant, position, stamp))
            else:
                free.discard(best)
                self._tracks[best].update(position, stamp)
                tracks.append(self._tracks[best])
        self._tracks = tracks


def _ahead(track: VelocityTracker, stamp: float) -> Vector:
    dt = stamp - track.stamp
    x, v = track.position, track.velocity
    return (x[0] + dt * v[0], x[1] + dt * v[1], x[2] + dt * v[2])
