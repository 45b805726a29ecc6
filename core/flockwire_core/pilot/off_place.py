"""Detects a drone in formation that is off its place, or has none, as reasons in its status."""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot

from flockwire_core.control.fence import Room
from flockwire_core.domain.body import Body, Separation, stands
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import Vector, subtract
from flockwire_core.pilot.phases import began
from flockwire_core.swarm.tables import Checks
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.status import Reason, Report

AT_THE_FENCE = Reason("at fence", "held at the fence")
OFF = "off place"  # the codes of the other reasons; all codes are shown instead of the phase
NO_PLACE = "no place"
HELD_BACK = 0.02  # m/s towards the wall, desired but not commanded
HELD_FOR = SECOND  # ns before it is reported


def shown_phase(report: Report) -> str:
    """Return the phase to show for a report: "formation" only for a drone at its place."""
    if report.phase != Phase.FORMATION:
        return report.phase
    codes = [reason.code for reason in report.reasons]
    return next((code for code in (OFF, NO_PLACE, AT_THE_FENCE.code) if code in codes), report.phase)


def no_place(
    place: Vector, position: Vector, bodies: Sequence[Body], separation: Separation, room: Room
) -> Reason | None:
    """Return why no drone can be at `place` (m, world frame), None if one can; `bodies` are relative to `position`."""
    if room.outside(place) > 0.0:
        return Reason(NO_PLACE, "its place is outside the fence")
    x, y = place[0] - position[0], place[1] - position[1]
    for body in bodies:
        bx, by, _ = body.relative_position
        if stands(body) and hypot(bx - x, by - y) < separation.from_axis(body):
            return Reason(NO_PLACE, "its place is nearer to an obstacle than the safety distance")
    return None


class OffPlace:
    """Watches one drone in `room`, judged by `checks`; call `reasons` for each status."""

    def __init__(self, room: Room, checks: Checks) -> None:
        self._room = room
        self._within = checks.formation_tail
        self._off_limit = round(checks.off_place * SECOND)  # ns
        self._settling_limit = max(self._off_limit, round(checks.settle_within * SECOND))  # ns
        self.forget()

    def forget(self) -> None:
        """Reset, because no formation is flown."""
        self._settled = False
        self._off_since = self._held_since = 0

    def reasons(
        self, error: float, position: Vector, wanted: Vector, given: Vector, now: int, placeless: Reason | None = None
    ) -> tuple[Reason, ...]:
        """Return the problems at `now` (Unix ns); a drone that is `placeless` is not off its place.

        `error` is the formation error, m (-1: it has none); `wanted` the velocity of its law, `given` that commanded,
        m/s. A drone is off its place if it was further from it than `checks.formation_tail` for `checks.off_place`, or
        for `checks.settle_within` before its first arrival.
        """
        off, found = placeless is None and error > self._within, []
        self._settled = self._settled or (placeless is None and 0.0 <= error <= self._within)
        self._off_since = began(self._off_since, off, now)
        held = _towards_wall(self._room, position, subtract(wanted, given))
        self._held_since = began(self._held_since, held, now)
        longest = self._off_limit if self._settled else self._settling_limit
        if held and now - self._held_since >= HELD_FOR:
            found.append(AT_THE_FENCE)
        if placeless is not None:
            found.append(placeless)
        elif off and now - self._off_since > longest:
            found.append(Reason(OFF, f"off its place for more than {longest / SECOND:g} s"))
        return tuple(found)


def _towards_wall(room: Room, position: Vector, lacking: Vector) -> bool:
    """Return whether `lacking` (m/s) leads towards a near wall."""
    if hypot(*lacking) <= HELD_BACK:
        return False
    near = [outwards for gap, outwards in room.sides(position) if gap < 0.5]  # m: the fence may hold a drone there
    return any(sum(n * v for n, v in zip(outwards, lacking, strict=True)) > HELD_BACK for outwards in near)
