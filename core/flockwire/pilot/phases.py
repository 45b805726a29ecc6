"""Flight phases: what a pilot (an agent, or the leader) does, and what makes it do something else.

grounded -> ready -> take-off -> hold <-> formation
                        any phase in flight -> landing -> grounded;  stop -> stopped
"""

from __future__ import annotations

from typing import NamedTuple

from flockwire.domain.order import Mission
from flockwire.domain.pose import Pose
from flockwire.domain.time import SECOND
from flockwire.pilot.orders import Orders
from flockwire.wire.phase import Phase

NEVER = float("inf")
SHUTDOWN = "its process must end"
OUTDATED = "on the ground since the last order: `flockwire start` takes it off"
ORDERLESS = 10 * SECOND  # ns that a pilot which was started in flight waits for an order
WITHOUT_ORDER = "in flight without an order: no station repeats one"
LAST_HOLD = SECOND  # ns that it holds at a shutdown before it lands


IN_FLIGHT = frozenset({Phase.TAKEOFF, Phase.HOLD, Phase.FORMATION, Phase.LANDING})


class Situation(NamedTuple):
    """What the phases depend on; the three reasons are empty if there is none."""

    now: int  # Unix time, ns
    unready: str  # why it must not take off
    hold: str  # why it must not fly the formation
    land: str  # why it must not fly at all
    airborne: bool  # the airframe flies
    high: bool  # at take-off height or above


class FlightPhases:
    """The phase a pilot is in, and why. `born` is when the pilot began, Unix ns."""

    def __init__(self, born: int) -> None:
        self.phase = Phase.GROUNDED
        self.reason = ""
        self.orders = Orders()
        self.mission: Mission | None = None  # the order that holds
        self._born = born  # a take-off needs an order given later than this
        self._retired: int | None = None  # when its shutdown began, Unix ns

    def order(self, mission: Mission, now: int) -> bool:
        """Take an order of an operator in at `now` (Unix ns); returns whether another one holds than before."""
        another = self.orders.take(mission, now)
        self.mission = self.orders.mission
        return another

    def stop(self) -> None:
        """Stop for good: only a new process flies again."""
        self.phase, self.reason = Phase.STOPPED, "emergency stop"

    def retire(self, now: int) -> None:
        """Hold, then land, and take off no more: the shutdown begins at `now` (Unix ns)."""
        self._retired = now if self._retired is None else self._retired

    def mission_time(self, now: int) -> float | None:
        """Return the formation's time t in s at `now` (Unix ns), None before an order to start."""
        mission = self.mission
        if mission is None or not mission.in_formation:
            return None
        return (now - mission.start) / SECOND

    def update(self, situation: Situation) -> Phase:
        """Return the phase that follows from `situation`."""
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
        outdated = self.orders.spent or mission.stamp <= self._born
        return (Phase.READY, OUTDATED) if outdated else (Phase.TAKEOFF, "")


def command_stamp(pose: Pose | None, now: int, stale_after: float) -> tuple[int, bool]:
    """Return the stamp of the command to give at `now` (Unix ns), and whether it answers `pose`.

    It does while the pose is not older than `stale_after` s. Else the stamp is that of the oldest pose that would still
    count: no later answer to a pose is older.
    """
    oldest = now - round(stale_after * SECOND)
    return (pose.stamp, True) if pose is not None and pose.stamp >= oldest else (oldest, False)


def age(stamp: int, now: int) -> float:
    """Return the age in s of what was stamped `stamp`, NEVER for 0 (nothing came yet)."""
    return (now - stamp) / SECOND if stamp else NEVER
