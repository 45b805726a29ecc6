"""Jumps that no airframe can make: held back until further frames confirm them, and counted."""

from __future__ import annotations

from typing import NamedTuple

from flockwire.domain.fields import from_fields
from flockwire.domain.time import SECOND
from flockwire.domain.vector import Vector, add, distance, scale, subtract

BASE = SECOND // 10  # ns, at least, between the sightings that give a velocity


class Sighting(NamedTuple):
    """The sighting of a body: `stamp` in ns, `position` in m."""

    stamp: int
    position: Vector


class JumpFilter:
    """Passes positions of bodies that could have flown there; counts `jumps` and how many were `confirmed`.

    `last` has the last accepted sighting of each body.

    A position within max_speed · dt + tolerance of the last one that passed passes at once. Any other is held back; it
    passes when `confirmations` frames in a row agree: the body was carried, or was confused before. Until then the body
    has no position, so its age grows.

    Args:
        max_speed: m/s, above what any airframe of the swarm reaches.
        tolerance: m, for noise and for frames with equal stamps.
        confirmations: frames that must agree before a jump is believed, 1 or more; 1 believes at once.

    """

    def __init__(self, max_speed: float, tolerance: float = 0.05, confirmations: int = 5) -> None:
        self.jumps = self.confirmed = 0
        self._max_speed, self._tolerance, self._confirmations = max_speed, tolerance, confirmations
        self.last: dict[int, Sighting] = {}
        self._bases: dict[int, tuple[Sighting, Sighting]] = {}  # the older and the newer start of a velocity
        self._candidates: dict[int, tuple[Sighting, int]] = {}  # where it seems to be now, and how many frames agree

    def passes(self, identity: int, stamp: int, position: Vector) -> bool:
        """Return whether the body `identity` can be at `position` (m) at `stamp` (ns)."""
        seen, last = Sighting(stamp, position), self.last.get(identity)
        if last is None or self.flies(last, stamp, position) or self._confirms(identity, seen):
            self.accept(identity, stamp, position)
            return True
        return False

    def accept(self, identity: int, stamp: int, position: Vector) -> None:
        """Record that the body `identity` is at `position` (m) at `stamp` (ns)."""
        seen = self.last[identity] = from_fields(Sighting, (stamp, position))
        base = self._bases.get(identity)
        if base is None:
            self._bases[identity] = seen, seen
        elif stamp - base[1].stamp >= BASE:
            self._bases[identity] = base[1], seen
        if self._candidates:
            self._candidates.pop(identity, None)

    def stamp(self, identity: int) -> int:
        """Return the stamp of the last accepted sighting of the body `identity`, ns; 0 before the first."""
        last = self.last.get(identity)
        return last.stamp if last is not None else 0

    def forget(self, identity: int) -> None:
        """Accept the next position of the body `identity` at any place."""
        self.last.pop(identity, None)
        self._bases.pop(identity, None)
        self._candidates.pop(identity, None)

    def _confirms(self, identity: int, seen: Sighting) -> bool:
        there, frames = self._candidates.get(identity, (None, 0))
        if there is None or not self.flies(there, *seen):
            self.jumps += 1
            frames = 0
        self._candidates[identity] = (seen, frames + 1)
        if frames + 1 < self._confirmations:
            return False
        self.confirmed += 1
        return True

    def predicted(self, identity: int, stamp: int) -> Vector:
        """Return where a body that was seen is at `stamp` (ns) if it goes on as it last moved, m."""
        last, base = self.last[identity], self._bases[identity][0]
        moved = last.stamp - base.stamp
        if moved <= 0:
            return last.position
        return add(last.position, scale(subtract(last.position, base.position), (stamp - last.stamp) / moved))

    def flies(self, last: Sighting, stamp: int, position: Vector) -> bool:
        """Return whether a body can have flown from its sighting `last` to `position` (m) by `stamp` (ns)."""
        before, place = last
        elapsed = max(0, stamp - before) / SECOND
        return distance(place, position) <= self._max_speed * elapsed + self._tolerance
