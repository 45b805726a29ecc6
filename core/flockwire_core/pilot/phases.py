"""The flight phases of a pilot (an agent, or the leader), by the table of transitions.

grounded -> ready -> take-off -> hold <-> formation
                        any phase in flight -> landing -> grounded;  stop -> stopped
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from flockwire_core.domain.order import Mission
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND
from flockwire_core.pilot.orders import Orders
from flockwire_core.pilot.reactions import HOLD, LAND, NO_REASON, REFUSE
from flockwire_core.pilot.transitions import bits, transition
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.status import Reason

NEVER: Final = float("inf")
OUTDATED: Final = Reason("order: outdated", "on the ground since the last order: `flockwire start` takes it off")
REASONS: Final = {"stop": Reason("stop", "emergency stop"), "outdated": OUTDATED}  # those that no reaction gives
IN_FLIGHT: Final = frozenset({Phase.TAKEOFF, Phase.HOLD, Phase.FORMATION, Phase.LANDING})
ORDERED: Final = {  # the conditions that an order makes hold
    "takeoff": bits(["up"]),
    "start": bits(["up", "formation"]),
    "formation": bits(["formation"]),
    "land": bits(["landing"]),
}
STOP: Final[int] = bits(["stop"])
AIRBORNE: Final[int] = bits(["airborne"])
HIGH: Final[int] = bits(["high"])
UNREADY: Final[int] = bits(["unready"])
DISTURBED: Final[int] = bits(["disturbed"])
DANGER: Final[int] = bits(["danger"])
SPENT: Final[int] = bits(["outdated"])


class FlightPhases:
    """The phase of a pilot, and its reason. `born` is the start of the pilot, Unix ns."""

    def __init__(self, born: int) -> None:
        self.phase = Phase.GROUNDED
        self.reason = NO_REASON
        self.orders = Orders()
        self._born = born  # a take-off needs a later order; after a landing without an order, its end
        self._outdated = False  # the order in force is not later

    @property
    def mission(self) -> Mission | None:
        """The order in force."""
        return self.orders.mission

    def order(self, mission: Mission, now: int) -> bool:
        """Receive an order at `now` (Unix ns); returns whether the order in force changed."""
        another = self.orders.take(mission, now)
        if another and self.mission is not None:
            self._outdated = self.mission.given <= self._born
        return another

    def stop(self) -> None:
        """Stop permanently: only a new process flies again."""
        self._go(STOP, {})

    def update(self, now: int, airborne: bool, high: bool, found: Mapping[str, Reason]) -> Phase:
        """Return the phase at `now` (Unix ns), after the reactions that were `found`.

        `airborne`: the airframe flies; `high`: at take-off height or above.
        """
        mission = self.mission
        ordered = ORDERED.get(mission.verb, 0) | SPENT * self._outdated if mission is not None else 0
        waits = mission is not None and now < mission.start
        flies = AIRBORNE * airborne | HIGH * high
        told = UNREADY * (REFUSE in found) | DISTURBED * (HOLD in found or waits) | DANGER * (LAND in found)
        conditions, was = ordered | flies | told, self.phase
        self._go(conditions, found)
        down = was in IN_FLIGHT and self.phase is Phase.GROUNDED
        if down and (mission is None or mission.verb != "land"):  # without an order
            self._born, self._outdated = now, mission is not None
        return self.phase

    def _go(self, conditions: int, found: Mapping[str, Reason]) -> None:
        """Take the transition under the `conditions` that hold; its reason is one of those `found`."""
        row = transition(self.phase, conditions)
        self.phase = row.after
        if row.reason != "kept":
            self.reason = REASONS.get(row.reason) or found.get(row.reason, NO_REASON)


def command_stamp(pose: Pose | None, now: int, stale_after: float) -> int:
    """Return the stamp of the command at `now` (Unix ns): that of `pose` if it is at most `stale_after` s old.

    Otherwise it is that of the oldest valid pose, so later answers are never older.
    """
    oldest = now - round(stale_after * SECOND)
    return max(pose.stamp, oldest) if pose is not None else oldest


def began(before: int, holds: bool, now: int) -> int:
    """Return when what `holds` at `now` began: then if it did not hold `before` (0), 0 while it does not hold."""
    return (before or now) if holds else 0


def age(stamp: int, now: int) -> float:
    """Return the age in s of the stamp `stamp`, NEVER for 0 (none yet)."""
    return (now - stamp) / SECOND if stamp else NEVER
