"""Leaves out a neighbour whose estimate of the leader contradicts the others, and reports it."""

from __future__ import annotations

from flockwire_core.control.agreement import contradicting, is_decided
from flockwire_core.domain.motion import LeaderMotion
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import Vector
from flockwire_core.law import Heard
from flockwire_core.swarm.model import uav
from flockwire_core.wire.status import LEFT_OUT, Reason

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
        t, (x, y, z), (vx, vy, vz) = (at - one.stamp) / SECOND, motion.position, motion.velocity
        positions[one.number] = (x + t * vx, y + t * vy, z + t * vz)
    return positions
