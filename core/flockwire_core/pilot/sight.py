"""What a follower's law sees of others, as the gateway measured it, and since when an in-neighbour is silent."""

from __future__ import annotations

from collections.abc import Container, Iterable, Mapping, Sequence
from typing import Final

from flockwire_core.domain.time import nanoseconds
from flockwire_core.law import Seen
from flockwire_core.pilot.phases import age
from flockwire_core.wire.sighting import Sighting


class Presence:
    """The in-neighbours with `numbers`; `stamps` is when each was noticed last, Unix ns, 0: never.

    One that was not noticed for `silence` s is `missing` at the last update.
    """

    def __init__(self, numbers: Iterable[int], silence: float) -> None:
        self.stamps = dict.fromkeys(numbers, 0)
        self.missing: tuple[int, ...] = ()
        self._silence, self.left_out = nanoseconds(silence), frozenset[int]()

    def leave_out(self, drones: Container[int]) -> None:
        """Ignore `drones` until called again."""
        self.left_out = frozenset([j for j in self.stamps if j in drones])

    def update(self, now: int) -> None:
        """Update who is missing at `now` (Unix ns)."""
        oldest = now - self._silence
        self.missing = tuple([j for j, stamp in self.stamps.items() if stamp < oldest and j not in self.left_out])

    def silence(self, now: int, since: int) -> float:
        """Return the time, s, since any was noticed, at most since `since`; 0 if none is expected."""
        stamps = [stamp for j, stamp in self.stamps.items() if j not in self.left_out]
        return age(max(since, *stamps), now) if stamps else 0.0

    def oldest(self, now: int) -> float:
        """Return the largest time, s, since one was noticed; NEVER if one never was."""
        return max([age(stamp, now) for j, stamp in self.stamps.items() if j not in self.left_out], default=0.0)


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
