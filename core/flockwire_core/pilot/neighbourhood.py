"""An agent's data from its in-neighbours, and its validity."""

from __future__ import annotations

from collections.abc import Callable, Container
from dataclasses import dataclass
from math import inf, isfinite
from typing import Final

from flockwire_core.domain.motion import Estimate, LeaderMotion, Leading
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import Vector, distance
from flockwire_core.law import Heard
from flockwire_core.pilot.agreement import Agreement
from flockwire_core.pilot.phases import IN_FLIGHT, NEVER, age
from flockwire_core.swarm.tables import Staleness
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.status import APART, Status

JUMP: Final = 0.2  # m, of the leader's pose, beyond what the speed allows
JUMP_TIME: Final = SECOND // 10  # ns between two poses, at most, for which the speed counts
LEADING_PHASES: Final = IN_FLIGHT - {Phase.LANDING}


@dataclass(slots=True)
class Neighbour:
    """One in-neighbour j: its weight w_ij and its newest data."""

    weight: float
    stamp: int = 0
    motion: LeaderMotion | None = None  # its estimate of the leader
    position: Vector | None = None
    origin: int = 0  # time of the leader's pose behind this, Unix ns
    hops: int = 0
    leading: Leading = Leading.UNKNOWN


class Neighbourhood:
    """The in-neighbours N_i of one follower, by their weights; `leader` is the leader, of the kind `kind`.

    A leader without an airframe leads in any phase: a virtual one while its status arrives, a tracked one while its
    pose arrives. Its pose is not used while it jumps (it flies at `speed` m/s), or is not its own by its status.
    Estimates may differ by `bound` m. The neighbours `closer` are fewer hops from the leader than the drone itself: if
    one of them reports that the leader is down, it is.
    """

    def __init__(
        self,
        weights: dict[int, float],
        limits: Staleness,
        kind: str = "trajectory",
        bound: float = inf,
        closer: frozenset[int] = frozenset(),
        speed: float = inf,
        leader: int | None = 0,
    ) -> None:
        self._every = {j: Neighbour(weight) for j, weight in weights.items()}
        self._neighbours = self._every  # without those that are left out
        self._drop_after = round(limits.estimate_drop * SECOND)  # ns
        self._origin_limit = round(limits.estimates_hold * SECOND)
        self._leader_limit = round(limits.leader_silent * SECOND)
        self._virtual, self._carried = kind == "virtual", kind == "tracked"
        self._leader = leader
        self._leader_stamp = 0  # of the leader's own status
        self.origin = 0  # of the newest data of the leader
        self.hops = 0
        self.leading = Leading.UNKNOWN
        self.missing: tuple[int, ...] = ()  # those without a valid estimate at the last update
        self.agreement = Agreement(bound, leader)
        self._compares, self._closer = isfinite(bound), closer
        self._speed, self._strayed = speed, False

    def leave_out(self, drones: Container[int]) -> None:
        """Ignore `drones` until called again."""
        self._neighbours = {j: neighbour for j, neighbour in self._every.items() if j not in drones}

    def take_estimate(self, j: int) -> Callable[[Estimate], None]:
        """Return the handler of neighbour j's estimates of the leader."""
        neighbour = self._every[j]

        def take(message: Estimate) -> None:
            neighbour.motion, neighbour.hops, neighbour.leading = message.motion, message.hops, message.leading
            neighbour.stamp, neighbour.origin = message.stamp, min(message.origin, message.stamp)

        return take

    def take_pose(self, j: int) -> Callable[[Pose], None]:
        """Return the handler of neighbour j's poses; the leader's pose is also its estimate of itself (eta_0 = x_0)."""
        neighbour = self._every[j]

        def take(message: Pose) -> None:
            if j == self._leader and (self._strayed or self._jumps(neighbour, message)):
                return
            neighbour.position = message.position
            if j == self._leader:
                neighbour.stamp = neighbour.origin = message.stamp
                neighbour.motion = LeaderMotion(message.position)

        return take

    def _jumps(self, leader: Neighbour, pose: Pose) -> bool:
        elapsed = pose.stamp - leader.stamp
        if leader.position is None or not 0 <= elapsed < 2 * SECOND // 5:  # ns: later its status tells of a jump
            return False
        reach = JUMP + 2.0 * self._speed * min(elapsed, JUMP_TIME) / SECOND
        return distance(leader.position, pose.position) > reach

    def take_status(self, message: Status) -> None:
        """Receive the leader's own status: whether it leads."""
        if self._leader is None:
            return
        self._leader_stamp = message.stamp
        self._strayed = any(reason.code == APART for reason in message.report.reasons)
        leads = self._virtual or message.report.phase in LEADING_PHASES
        self._every[self._leader].leading = Leading.LEADS if leads else Leading.IS_DOWN

    def update(self, now: int) -> list[Heard]:
        """Update the leader's state; return the valid estimates of the neighbours at `now` (Unix ns).

        A valid estimate is fresh and based on fresh data: passing data on does not make it younger. A stale neighbour
        is removed from the sum, and so is one that contradicts the others.
        """
        oldest, oldest_origin = now - self._drop_after, now - self._origin_limit
        found, missing = [], []
        for j, neighbour in self._neighbours.items():
            stamp, motion = neighbour.stamp, neighbour.motion
            if stamp < oldest or motion is None or neighbour.origin < oldest_origin:
                missing.append(j)
            else:
                found.append(Heard(j, neighbour.weight, j == self._leader, stamp, 0, motion))
        self.missing = tuple(missing)
        if self._compares and len(found) > 1:
            found = self.agreement.kept(found, now)
        elif self.agreement.contradicted:
            self.agreement.forget()
        self._follow(found, now)
        return found

    def _follow(self, found: list[Heard], now: int) -> None:
        """Update the leader's state by the valid estimates."""
        down = False
        for estimate in found:
            j = estimate.number
            neighbour = self._neighbours[j]
            if neighbour.origin > self.origin:
                self.origin, self.hops = neighbour.origin, min(neighbour.hops + 1, 255)  # largest number in a message
                self.leading = neighbour.leading
            down = down or (neighbour.leading is Leading.IS_DOWN and j in self._closer)
        if down:
            self.leading = Leading.IS_DOWN
        if self._leader is not None and self._leader in self._neighbours:
            self.leading = self._leading(self._neighbours[self._leader], now)

    def _leading(self, leader: Neighbour, now: int) -> Leading:
        """Return the state in the leader's own status, or by the pose of a carried one; if that is old, it is down."""
        stamp = leader.stamp if self._carried else self._leader_stamp
        if not stamp:
            return Leading.UNKNOWN
        if now - stamp > self._leader_limit:
            return Leading.IS_DOWN
        return Leading.LEADS if self._carried else leader.leading

    def silence(self, now: int, since: int) -> float:
        """Return the age, s, of the newest data of the leader; without any, the time since `since`."""
        return age(max(self.origin, since), now)

    def oldest(self, now: int) -> float:
        """Return the largest age, s, of a neighbour's data; NEVER if one has not sent any."""
        return max((age(neighbour.stamp, now) for neighbour in self._neighbours.values()), default=NEVER)

    def positions(self) -> list[Vector]:
        """Return the neighbours' known positions (m, world frame)."""
        return [neighbour.position for neighbour in self._neighbours.values() if neighbour.position is not None]
