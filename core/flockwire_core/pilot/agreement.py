"""Agreement among estimates of the leader: a neighbour whose estimate contradicts the others is left out, and reported.

The observer (8) averages its neighbours, so one false neighbour moves every follower behind it. Estimates that are too
far from the others are left out before the average is taken, as in resilient consensus: LeBlanc, Zhang, Koutsoukos,
Sundaram, Resilient Asymptotic Consensus in Robust Networks, IEEE JSAC 31(4), 2013. That rule always leaves out the F
largest and the F smallest values; here a bound decides (ours), so honest neighbours are all used.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import dist

from flockwire_core.domain.motion import LeaderMotion
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import Vector
from flockwire_core.law import Heard
from flockwire_core.swarm.model import uav
from flockwire_core.wire.status import LEFT_OUT, Reason


def contradicting(positions: Mapping[int, Vector], bound: float, leader: int | None) -> tuple[int, ...]:
    """Return who of `positions` (m, by the neighbour's number) is farther than `bound` m from the reference.

    The reference is the own position of `leader` if it is there, else the median of each axis. With one false position
    of three or more, the median is between true ones. Of two positions that differ by more than `bound`, both are
    returned, as nobody can tell which is false.
    """
    reference = positions.get(leader) if leader is not None else None
    if reference is None:
        if len(positions) == 2:
            one, other = positions.values()
            return tuple(positions) if dist(one, other) > bound else ()
        xs, ys, zs = zip(*positions.values(), strict=True)
        reference = (_median(xs), _median(ys), _median(zs))
    left_out: tuple[int, ...] = ()
    for j, position in positions.items():  # a comprehension is a call of its own
        if dist(position, reference) > bound:
            left_out += (j,)
    return left_out


def _median(values: Iterable[float]) -> float:
    ordered = sorted(values)  # that of `statistics` takes 0.1 MB of each agent
    half = len(ordered) // 2
    return ordered[half] if len(ordered) % 2 else (ordered[half - 1] + ordered[half]) / 2


def is_decided(positions: Mapping[int, Vector], left_out: tuple[int, ...], leader: int | None) -> bool:
    """Return whether those that remain without `left_out` can be believed: the leader, or a majority."""
    return leader in positions or 2 * len(left_out) < len(positions)


DISAGREE = "disagree about the leader"
BELIEVED = SECOND  # ns that a contradiction must last to be reported, or to hold the drone: observers settle sooner


class Agreement:
    """Compares the valid estimates of one follower's neighbours, which may differ by `bound` m."""

    def __init__(self, bound: float, leader: int | None) -> None:
        self.count = 0  # estimates left out
        self.contradicted = False  # at the last call
        self._bound, self._leader = bound, leader
        self._left_out: dict[int, int] = {}  # since when, Unix ns, by the neighbour's number
        self._disputed = 0  # since when no majority agrees, Unix ns; 0: one does
        self._parties: tuple[int, ...] = ()  # who disagrees then

    def kept(self, estimates: list[Heard], now: int) -> list[Heard]:
        """Return the estimates to use of two or more that are valid at `now` (Unix ns).

        They are all used while there is no majority: `reason` then makes the drone hold.
        """
        positions = placed(estimates, self._leader)
        left_out = contradicting(positions, self._bound, self._leader)
        if not left_out:
            if self.contradicted:
                self.forget()
            return estimates
        self.contradicted = True
        if not is_decided(positions, left_out, self._leader):
            self._left_out, self._disputed, self._parties = {}, self._disputed or now, left_out
            return estimates
        self._disputed = 0
        self._left_out = {j: self._left_out.get(j, now) for j in left_out}
        self.count += len(left_out)
        return [estimate for estimate in estimates if estimate.number not in left_out]

    def forget(self) -> None:
        """Reset: nothing contradicts."""
        self.contradicted, self._left_out, self._disputed = False, {}, 0

    def reason(self, now: int) -> str:
        """Return why the drone must not fly the formation at `now` (Unix ns), empty without a reason."""
        if not self._lasts(self._disputed, now):
            return ""
        return f"{' and '.join(map(uav, self._parties))} {DISAGREE} by more than {self._bound:g} m"

    def reasons(self, now: int) -> tuple[Reason, ...]:
        """Return the contradictions that last at `now` (Unix ns), for the status."""
        names = ", ".join([uav(j) for j, since in self._left_out.items() if self._lasts(since, now)])
        if not names:
            return ()
        text = f"leaves out the estimate of {names}, more than {self._bound:g} m from the others"
        return (Reason(LEFT_OUT, text, "land, and examine that agent"),)

    def _lasts(self, since: int, now: int) -> bool:
        return since > 0 and now - since >= BELIEVED


def placed(estimates: list[Heard], leader: int | None) -> dict[int, Vector]:
    """Return where each neighbour sees the leader, at the time of the leader's pose, else of the newest estimate."""
    at = 0
    for one in estimates:
        if one.number == leader:
            at = one.stamp
            break
        at = max(at, one.stamp)
    positions: dict[int, Vector] = {}
    for one in estimates:
        motion: LeaderMotion = one.content
        t, x, v = (at - one.stamp) / SECOND, motion.position, motion.velocity
        positions[one.number] = (x[0] + t * v[0], x[1] + t * v[1], x[2] + t * v[2])
    return positions
