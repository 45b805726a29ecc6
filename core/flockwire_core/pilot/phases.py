"""The flight phases of a pilot (an agent, or the leader), and their transitions.

grounded -> ready -> take-off -> hold <-> formation
                        any phase in flight -> landing -> grounded;  stop -> stopped
"""

from __future__ import annotations

from typing import Final

from flockwire_core.compiling import mypyc_attr
from flockwire_core.domain.order import Mission
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.record import Record
from flockwire_core.domain.time import SECOND
from flockwire_core.pilot.orders import Orders
from flockwire_core.wire.phase import Phase

NEVER: Final = float("inf")
SHUTDOWN: Final = "its process must end"
OUTDATED = "on the ground since the last order: `flockwire start` takes it off"
ORDERLESS: Final = 10 * SECOND  # ns for which a pilot started in flight waits for an order
WITHOUT_ORDER: Final = "in flight without an order: no station repeats one"
LAST_HOLD: Final = SECOND  # ns of hold at a shutdown before landing

IN_FLIGHT: Final = frozenset({Phase.TAKEOFF, Phase.HOLD, Phase.FORMATION, Phase.LANDING})


@mypyc_attr(acyclic=True)
class Situation(Record):
    """The input of the phases; each of the three reasons may be empty."""

    __slots__ = ("now", "unready", "hold", "land", "airborne", "high")

    def __init__(self, now: int, unready: str, hold: str, land: str, airborne: bool, high: bool) -> None:
        self.now: Final = now  # Unix time, ns
        self.unready: Final = unready  # why it must not take off
        self.hold: Final = hold  # why it must not fly the formation
        self.land: Final = land  # why it must not fly at all
        self.airborne: Final = airborne  # the airframe flies
        self.high: Final = high  # at take-off height or above


class FlightPhases:
    """The phase of a pilot, and its reason. `born` is the start of the pilot, Unix ns."""

    def __init__(self, born: int) -> None:
        self.phase = Phase.GROUNDED
        self.reason = ""
        self.orders = Orders()
        self.mission: Mission | None = None  # the order in force
        self._born = born  # a take-off needs a later order
        self._outdated = False  # the order in force is not later
        self._retired: int | None = None  # start of its shutdown, Unix ns

    def order(self, mission: Mission, now: int) -> bool:
        """Receive an order at `now` (Unix ns); returns whether the order in force changed."""
        another = self.orders.take(mission, now)
        self.mission = self.orders.mission
        if another and self.mission is not None:
            self._outdated = self.mission.given <= self._born
        return another

    def stop(self) -> None:
        """Stop permanently: only a new process flies again."""
        self.phase, self.reason = Phase.STOPPED, "emergency stop"

    def retire(self, now: int) -> None:
        """Start the shutdown at `now` (Unix ns): hold, then land, and do not take off again."""
        self._retired = now if self._retired is None else self._retired

    def mission_time(self, now: int) -> float | None:
        """Return the formation's time t in s at `now` (Unix ns), None before a start order."""
        mission = self.mission
        if mission is None or not mission.in_formation:
            return None
        return (now - mission.start) / SECOND

    def update(self, situation: Situation) -> Phase:
        """Return the phase for `situation`."""
        was = self.phase
        self.phase, self.reason = self._next(self._retiring(situation))
        if was in IN_FLIGHT and self.phase is Phase.GROUNDED:
            self.orders.ended()
        return self.phase

    def _retiring(self, at: Situation) -> Situation:
        if self._retired is None:
            return at
        landing = at.now - self._retired >= LAST_HOLD
        return at._replace(unready=SHUTDOWN, hold=SHUTDOWN, land=at.land or (SHUTDOWN if landing else ""))

    def _next(self, at: Situation) -> tuple[Phase, str]:
        mission = self.mission
        verb = mission.verb if mission is not None else ""
        if self.phase is Phase.STOPPED:
            return self.phase, self.reason
        if self.phase is Phase.LANDING:
            return (Phase.LANDING, self.reason) if at.airborne else (Phase.GROUNDED, at.unready)
        if self.phase in (Phase.GROUNDED, Phase.READY):
            return self._on_ground(at, verb)
        if self.phase is not Phase.TAKEOFF and not at.airborne:  # its driver set it down
            return Phase.GROUNDED, at.unready
        land = at.land or (WITHOUT_ORDER if mission is None and at.now - self._born >= ORDERLESS else "")
        if verb == "land" or land:
            return Phase.LANDING, land
        return self._in_flight(at, verb)

    def _in_flight(self, at: Situation, verb: str) -> tuple[Phase, str]:
        if self.phase is Phase.TAKEOFF and not at.high:
            return Phase.TAKEOFF, ""
        mission = self.mission
        ordered = mission is not None and mission.in_formation
        if ordered and not at.hold and mission is not None and at.now >= mission.start:
            return Phase.FORMATION, ""
        return Phase.HOLD, at.hold if ordered else ""

    def _on_ground(self, at: Situation, verb: str) -> tuple[Phase, str]:
        if at.airborne:  # this process was started in flight
            return Phase.HOLD, ""
        if at.unready:
            return Phase.GROUNDED, at.unready
        mission = self.mission
        if mission is None or verb not in ("takeoff", "start"):
            return Phase.READY, ""
        outdated = self.orders.spent or self._outdated
        return (Phase.READY, OUTDATED) if outdated else (Phase.TAKEOFF, "")


def command_stamp(pose: Pose | None, now: int, stale_after: float) -> tuple[int, bool]:
    """Return the stamp of the command at `now` (Unix ns), and whether it answers `pose`.

    It does if the pose is at most `stale_after` s old. Otherwise the stamp is that of the oldest valid pose, so later
    answers are never older.
    """
    oldest = now - round(stale_after * SECOND)
    return (pose.stamp, True) if pose is not None and pose.stamp >= oldest else (oldest, False)


def age(stamp: int, now: int) -> float:
    """Return the age in s of the stamp `stamp`, NEVER for 0 (none yet)."""
    return (now - stamp) / SECOND if stamp else NEVER
