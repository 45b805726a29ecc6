"""Jumps that no airframe can make: held back until further frames confirm them, and counted."""

from __future__ import annotations

from typing import Final

from flockwire.domain.time import SECOND
from flockwire.domain.vector import Vector, add, scale, subtract

from flockwire_mocap.claim import Claim

BASE: Final = SECOND // 10  # ns, at least, between the claims that give a velocity


class JumpFilter:
    """Passes positions of bodies that could have flown there; counts `jumps` and how many were `confirmed`.

    `last` has the last accepted claim of each drone.

    A position within max_speed · dt + tolerance of the last one that passed passes at once. Any other is held back; it
    passes when `confirmations` frames in a row agree: the drone was carried, or was confused before. Until then it has
    no position, so its age grows.

    Args:
        max_speed: m/s, above what any airframe of the swarm reaches.
        tolerance: m, for noise and for frames with equal stamps.
        confirmations: frames that must agree before a jump is believed, 1 or more; 1 believes at once.

    """

    def __init__(self, max_speed: float, tolerance: float = 0.05, confirmations: int = 5) -> None:
        self.jumps = self.confirmed = 0
        self._max_speed, self._tolerance, self._confirmations = max_speed, tolerance, confirmations
        self.last: dict[int, Claim] = {}
        self._bases: dict[int, tuple[Claim, Claim]] = {}  # the older and the newer start of a velocity
        self._candidates: dict[int, tuple[Claim, int]] = {}  # where it seems to be now, and how many frames agree

    def passes(self, claim: Claim) -> bool:
        """Return whether the drone can be there; if so, accept the claim."""
        last = self.last.get(claim.drone)
        if last is None or self.flies(last, claim.stamp, claim.position) or self._confirms(claim):
            self.accept(claim.drone, claim)
            return True
        return False

    def accept(self, drone: int, claim: Claim) -> None:
        """Record that `drone` is where `claim`, perhaps in another drone's name, has its body."""
        self.last[drone] = claim
        base = self._bases.get(drone)
        if base is None:
            self._bases[drone] = claim, claim
        elif claim.stamp - base[1].stamp >= BASE:
            self._bases[drone] = base[1], claim
        if self._candidates:
            self._candidates.pop(drone, None)

    def stamp(self, drone: int) -> int:
        """Return the stamp of the last accepted claim of `drone`, ns; 0 before the first."""
        last = self.last.get(drone)
        return last.stamp if last is not None else 0

    def forget(self, drone: int) -> None:
        """Accept the next position of `drone` at any place."""
        self.last.pop(drone, None)
        self._bases.pop(drone, None)
        self._candidates.pop(drone, None)

    def _confirms(self, claim: Claim) -> bool:
        there, frames = self._candidates.get(claim.drone, (None, 0))
        if there is None or not self.flies(there, claim.stamp, claim.position):
            self.jumps += 1
            frames = 0
        self._candidates[claim.drone] = (claim, frames + 1)
        if frames + 1 < self._confirmations:
            return False
        self.confirmed += 1
        return True

    def predicted(self, drone: int, stamp: int) -> Vector:
        """Return where a drone that was seen is at `stamp` (ns) if it goes on as it last moved, m."""
        last, base = self.last[drone], self._bases[drone][0]
        moved = last.stamp - base.stamp
        if moved <= 0:
            return last.position
        return add(last.position, scale(subtract(last.position, base.position), (stamp - last.stamp) / moved))

    def follows(self, claim: Claim, pause: int) -> bool:
        """Return whether the drone can have flown there, from where it was at most `pause` ns ago."""
        last = self.last.get(claim.drone)
        return last is not None and claim.stamp - last.stamp <= pause and self.flies(last, claim.stamp, claim.position)

    def flies(self, last: Claim, stamp: int, position: Vector) -> bool:
        """Return whether a body can have flown from its claim `last` to `position` (m) by `stamp` (ns)."""
        place, elapsed = last.position, max(0, stamp - last.stamp) / SECOND
        x, y, z = position[0] - place[0], position[1] - place[1], position[2] - place[2]
        reach = self._max_speed * elapsed + self._tolerance
        return x * x + y * y + z * z <= reach * reach
