"""What a follower's law sees of others, as the gateway measured it."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from typing import Final

from flockwire_core.domain.time import nanoseconds
from flockwire_core.law import Seen
from flockwire_core.pilot.phases import age
from flockwire_core.wire.sighting import Sighting

NOBODY: Final = Sighting(0, "", (), ())


class Sight:
    """The in-neighbours of one drone, by their `weights`, and the drones around; those of `leaders` say so.

    What is older than `silence` s is not used. `neighbours`, `around` and `missing` are of the last update.
    """

    def __init__(self, weights: Mapping[int, float], leaders: Container[int], silence: float) -> None:
        self._weights, self._leaders, self._silence = weights, leaders, nanoseconds(silence)
        self._left_out = frozenset[int]()
        self._last = NOBODY
        self._stamps = dict.fromkeys(weights, 0)
        self.neighbours: Sequence[Seen] = ()
        self.around: Sequence[Seen] = ()
        self.missing: tuple[int, ...] = ()

    def take(self, sighting: Sighting) -> None:
        """Receive what the drone sees; an entry that is no in-neighbour is left out."""
        self._last = sighting
        for seen in sighting.neighbours:
            if seen.number in self._stamps:
                self._stamps[seen.number] = sighting.stamp

    def leave_out(self, drones: Container[int]) -> None:
        """Ignore `drones` until called again."""
        self._left_out = frozenset([j for j in self._weights if j in drones])

    def update(self, now: int) -> None:
        """Update what is seen at `now` (Unix ns)."""
        oldest, last = now - self._silence, self._last
        self.missing = tuple([j for j, stamp in self._stamps.items() if stamp < oldest and j not in self._left_out])
        if last.stamp < oldest:
            self.neighbours = self.around = ()
            return
        self.around = last.around
        self.neighbours = [
            Seen(
                seen.number, self._weights[seen.number], seen.number in self._leaders, seen.bearing, seen.distance,
                seen.position, seen.velocity, seen.age,
            )
            for seen in last.neighbours
            if seen.number in self._weights and seen.number not in self._left_out
        ]  # fmt: skip

    def silence(self, now: int, since: int) -> float:
        """Return the time, s, since any neighbour was seen, at most since `since`; 0 if none is expected."""
        stamps = [stamp for j, stamp in self._stamps.items() if j not in self._left_out]
        return age(max(since, *stamps), now) if stamps else 0.0

    def oldest(self, now: int) -> float:
        """Return the largest time, s, since a neighbour was seen; NEVER if one never was."""
        return max([age(stamp, now) for j, stamp in self._stamps.items() if j not in self._left_out], default=0.0)
