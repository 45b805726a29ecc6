"""Assigns bodies to drones: checks a tracker's names against the places that each drone can have reached.

Motion is continuous, but names may jump: a body named uav2 at the last place of uav3 belongs to uav3. Two drones whose
names were exchanged are in doubt: each keeps the pose of its previous body, and both are reported. A name that jumps to
a place where no drone was is held back until further frames confirm it (jumps.py).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import combinations
from typing import Final, NamedTuple

from flockwire.domain.time import SECOND
from flockwire.domain.vector import Vector, distance

from flockwire_mocap.claim import Claim, in_order
from flockwire_mocap.jumps import JumpFilter

FRESH: Final = SECOND  # ns for which a sighting identifies a body
GAP: Final = SECOND // 20  # ns without a drone after which its name alone does not identify a body
RESTORED: Final = SECOND  # ns for which names must be right until the doubt ends
BLACKOUT: Final = 2 * SECOND // 5  # ns without any body after which the next frame counts as the first
EXCHANGED: Final = 2.0  # times nearer to where the other one flew: exchanged in a blackout of less than FRESH
NOISE: Final = 3.0  # times the tolerance: a body that jumps less far is not another's, if nobody's last place is nearer
FORGOTTEN: Final = 3 * SECOND  # ns without any body after which a doubt ends: the next frame counts as the first


class Doubt(NamedTuple):
    """Begin and end (0: not ended) of a drone's name on another body, ns."""

    since: int
    restored: int = 0


class Identities:
    """Passes plausible claims; counts `swaps`, and in `jumps` those of `JumpFilter`.

    Attributes:
        doubts: the drones in doubt.

    """

    def __init__(self, max_speed: float, tolerance: float) -> None:
        self.jumps = JumpFilter(max_speed, tolerance)
        self.swaps = 0
        self._tolerance = tolerance
        self.doubts: dict[int, Doubt] = {}

    def judge(self, claims: list[Claim]) -> tuple[list[Claim], list[Claim]]:
        """Return the accepted claims, each with its drone, and those that are held back."""
        self._forget_blackout(claims)
        suspects = [claim for claim in claims if not self._plausible(claim, claims)]
        if not suspects and not self.doubts:
            for claim in claims:
                self.jumps.accept(claim.drone, claim)
            return claims, []
        believable = {claim.drone for claim in claims}.difference(claim.drone for claim in suspects)
        for claim in suspects:
            self._suspect(claim, believable)
        return self._sorted_out(claims)

    def _plausible(self, claim: Claim, claims: list[Claim]) -> bool:
        """Return whether the drone can be there; after a gap also whether no other drone is there or is more likely."""
        return self.jumps.follows(claim, GAP) or self._plausible_after_gap(claim, claims)

    def _plausible_after_gap(self, claim: Claim, claims: list[Claim]) -> bool:
        stamp, drone, position = claim.stamp, claim.drone, claim.position
        last = self.jumps.last.get(drone)
        if last is None:
            return not self._others(claim, self._fresh(stamp))
        if not self.jumps.flies(last, stamp, position):
            return False
        if self._on_another(claim, claims):
            return False
        named = {other.drone for other in claims}
        missing = [
            i
            for i in self._fresh(stamp)
            if stamp - self.jumps.stamp(i) > GAP
            or (i not in named and self.jumps.flies(self.jumps.last[i], stamp, position))  # it was just here
        ]
        nearest = min(missing, key=lambda i: self._distance(i, position), default=drone)
        return nearest == drone or self._distance(nearest, position) > distance(last.position, position)

    def _suspect(self, claim: Claim, believable: set[int]) -> None:
        """Put the claim's drone in doubt, and the drone that was at this place, if any."""
        fresh = [i for i in self._fresh(claim.stamp) if i not in believable]
        if self._is_noise(claim, fresh):
            return
        for other in self._others(claim, fresh):
            new = [drone for drone in (claim.drone, other) if drone not in self.doubts]
            self.swaps += bool(new)
            self.doubts |= {drone: Doubt(claim.stamp) for drone in new}
            return

    def _sorted_out(self, claims: list[Claim]) -> tuple[list[Claim], list[Claim]]:
        believed, held = list[Claim](), list[Claim]()
        pool = [claim for claim in claims if claim.drone in self.doubts]
        for claim in claims:
            if claim.drone not in self.doubts:
                (believed if self._passes(claim, claims) else held).append(claim)
        for once in sightings(pool):
            owners = self._continued(once)
            for claim in once:
                owner = owners.get(claim.drone)
                if owner is None:
                    held.append(claim)
                    continue
                self.jumps.accept(owner, claim)
                self._restore(owner, owner == claim.drone, claim.stamp)
                believed.append(claim._replace(drone=owner))
        newest = max((claim.stamp for claim in claims), default=0)
        self._forget(newest)
        return sorted(believed, key=in_order), held

    def _passes(self, claim: Claim, claims: list[Claim]) -> bool:
        if self._plausible(claim, claims):
            self.jumps.accept(claim.drone, claim)
            return True
        if self._on_another(claim, claims):
            return False
        return self.jumps.passes(claim)

    def _on_another(self, claim: Claim, claims: list[Claim]) -> bool:
        """Return whether another drone is seen at the claim's place: two cannot be in one place."""
        return any(
            other.drone != claim.drone and distance(other.position, claim.position) < self._tolerance
            for other in claims
        )

    def _continued(self, pool: list[Claim]) -> dict[int, int]:
        """Return the drone of each name's body: the nearest that can have flown there, each drone once."""
        known = self.jumps.last
        pairs = sorted(
            (self._distance(owner, claim.position), owner, claim.drone)
            for claim in pool
            if not self._is_noise(claim, self.doubts)
            for owner in self.doubts
            if owner in known and self.jumps.flies(known[owner], claim.stamp, claim.position)
        )
        owners: dict[int, int] = {}
        for _, owner, name in pairs:
            if name not in owners and owner not in owners.values():
                owners[name] = owner
        return owners

    def _forget_blackout(self, claims: list[Claim]) -> None:
        """Restart after a time in which no drone was seen at all, unless names were mixed up before it or meanwhile."""
        if not claims or self.doubts or claims[0].stamp - self.jumps.stamp(claims[0].drone) <= BLACKOUT:
            return
        newest = max([last.stamp for last in self.jumps.last.values()], default=0)
        if claims[0].stamp - newest <= BLACKOUT:
            return
        if claims[0].stamp - newest < FRESH:
            for a, b in self._exchanged(claims):
                self.swaps += 1
                self.doubts |= {drone: Doubt(claims[0].stamp) for drone in (a, b)}
        for drone in tuple(self.jumps.last):
            if drone not in self.doubts:
                self.jumps.forget(drone)
        if self.doubts:  # these places are taken
            for claim in claims:
                if claim.drone not in self.doubts:
                    self.jumps.accept(claim.drone, claim)

    def _exchanged(self, claims: list[Claim]) -> list[tuple[int, int]]:
        """Return the pairs of drones of which each is where the other one would be if it went on as it last moved."""

        def misses(a: Claim, one: int, b: Claim, other: int) -> float:
            at = self.jumps.predicted
            return distance(at(one, a.stamp), a.position) + distance(at(other, b.stamp), b.position)

        fresh = self._fresh(claims[0].stamp)
        pairs = combinations([claim for claim in claims if claim.drone in fresh], 2)
        return [
            (a.drone, b.drone)
            for a, b in pairs
            if misses(a, a.drone, b, b.drone)
            > max(EXCHANGED * misses(a, b.drone, b, a.drone), NOISE * 2.0 * self._tolerance)
        ]

    def _restore(self, drone: int, right: bool, stamp: int) -> None:
        doubt = self.doubts[drone]
        self.doubts[drone] = doubt._replace(restored=(doubt.restored or stamp) if right else 0)

    def _forget(self, now: int) -> None:
        for drone, doubt in tuple(self.doubts.items()):
            lost = now - max(self.jumps.stamp(drone), doubt.since) > FORGOTTEN
            if lost:
                self.jumps.forget(drone)
            if lost or (doubt.restored and now - doubt.restored > RESTORED):
                del self.doubts[drone]

    def _fresh(self, stamp: int) -> list[int]:
        return [i for i in self.jumps.last if stamp - self.jumps.stamp(i) < FRESH]

    def _others(self, claim: Claim, drones: Iterable[int]) -> list[int]:
        """Return those of `drones` that can have flown to the claim's place, the nearest first."""
        last, stamp, position = self.jumps.last, claim.stamp, claim.position
        found = [i for i in drones if i != claim.drone and self.jumps.flies(last[i], stamp, position)]
        return sorted(found, key=lambda i: self._distance(i, claim.position))

    def _is_noise(self, claim: Claim, drones: Iterable[int]) -> bool:
        """Return whether the drone of the nearest last place cannot have flown to the claim's, but almost.

        Among `drones` and the one that is named: another one, unseen for longer, can often have flown there.
        """
        nearest = min((claim.drone, *drones), key=lambda i: self._distance(i, claim.position))
        last, near = self.jumps.last.get(nearest), self._distance(nearest, claim.position) <= NOISE * self._tolerance
        return last is not None and near and not self.jumps.flies(last, claim.stamp, claim.position)

    def _distance(self, drone: int, position: Vector) -> float:
        last = self.jumps.last.get(drone)
        return distance(last.position, position) if last is not None else float("inf")


def sightings(claims: list[Claim]) -> list[list[Claim]]:
    """Return the claims in groups with one for each name, the oldest first: names may be exchanged between two."""
    groups: list[list[Claim]] = []
    for claim in sorted(claims, key=in_order):
        group = next((one for one in groups if all(claim.drone != other.drone for other in one)), None)
        if group is None:
            groups.append([claim])
        else:
            group.append(claim)
    return groups


def owner(drones: Mapping[str | int, int], identity: int, name: str | None) -> int | None:
    """Return whose of `drones` (by body) the body with this number and name is, the name first; None: no drone's."""
    drone = drones.get(name) if name is not None else None
    return drones.get(identity) if drone is None else drone
