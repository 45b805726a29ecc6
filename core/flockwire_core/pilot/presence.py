"""Since when each in-neighbour of a drone is silent, by whatever way it is noticed."""

from __future__ import annotations

from collections.abc import Container, Iterable

from flockwire_core.domain.time import nanoseconds
from flockwire_core.pilot.phases import age


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
