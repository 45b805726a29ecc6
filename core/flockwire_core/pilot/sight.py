"""What a follower's law sees of others, as the gateway measured it."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from typing import Final

from flockwire_core.law import Seen
from flockwire_core.pilot.presence import Presence
from flockwire_core.wire.sighting import Sighting

NOBODY: Final = Sighting(0, "", (), ())


class Sight(Presence):
    """The in-neighbours of one drone, by their `weights`, and the drones around; those of `leaders` say so.

    What is older than `silence` s is not used. `neighbours` and `around` are of the last update.
    """

    def __init__(self, weights: Mapping[int, float], leaders: Container[int], silence: float) -> None:
        super().__init__(weights, silence)
        self._weights, self._leaders = weights, leaders
        self._last = NOBODY
        self.neighbours: Sequence[Seen] = ()
        self.around: Sequence[Seen] = ()

    def take(self, sighting: Sighting) -> None:
        """Receive what the drone sees; an entry that is no in-neighbour is left out."""
        self._last = sighting
        for seen in sighting.neighbours:
            if seen.number in self.stamps:
                self.stamps[seen.number] = sighting.stamp

    def update(self, now: int) -> None:
        """Update what is seen at `now` (Unix ns)."""
        super().update(now)
        last = self._last
        if last.stamp < now - self._silence:
            self.neighbours = self.around = ()
            return
        self.around = last.around
        self.neighbours = [
            Seen(
                seen.number, self._weights[seen.number], seen.number in self._leaders, seen.bearing, seen.distance,
                seen.position, seen.velocity, seen.age,
            )
            for seen in last.neighbours
            if seen.number in self._weights and seen.number not in self.left_out
        ]  # fmt: skip
