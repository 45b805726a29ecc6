"""The flight phases of a pilot (an agent, or the leader), by the table transitions.csv, one row for each transition.

grounded -> ready -> take-off -> hold <-> formation
                        any phase in flight -> landing -> grounded;  stop -> stopped

The first row that names the phase, and whose conditions hold, gives the next phase and its reason; `!` means: does not
hold. FlightPhases flies the table, lab/model/ explores it, and the check "conformance" replays each flight by it.
"""

from __future__ import annotations

import csv
from collections.abc import Iterable, Mapping
from functools import cache
from importlib.resources import files
from typing import Final, NamedTuple

from flockwire_core.domain.order import Mission
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND
from flockwire_core.pilot.orders import Orders
from flockwire_core.pilot.reactions import HOLD, LAND, NO_REASON, REFUSE
from flockwire_core.wire.phase import PILOT_PHASES, Phase
from flockwire_core.wire.status import Reason

NEVER: Final = float("inf")
OUTDATED: Final = Reason("order: outdated", "on the ground since the last order: `flockwire start` takes it off")
REASONS: Final = {"stop": Reason("stop", "emergency stop"), "outdated": OUTDATED}  # those that no reaction gives
IN_FLIGHT: Final = frozenset({Phase.TAKEOFF, Phase.HOLD, Phase.FORMATION, Phase.LANDING})
CONDITIONS = {
    "stop": "an emergency stop was received",
    "airborne": "the airframe flies, by the telemetry that the pilot has",
    "high": "it is at take-off height or above",
    "unready": "something keeps it from taking off",
    "disturbed": "something keeps it from the formation, or the formation's time 0 is still to come",
    "danger": "something forbids to fly",
    "up": "the order that holds takes up from the ground",
    "outdated": "that order is from before the process began, or the drone came down since",
    "formation": "the order that holds is to fly a formation",
    "landing": "the order that holds is to land",
}
BITS = {name: 1 << place for place, name in enumerate(CONDITIONS)}


class Transition(NamedTuple):
    """One row: from any phase of `before`, while `required` hold and none of `forbidden` does, `after` follows."""

    before: frozenset[Phase]
    required: tuple[str, ...]
    forbidden: tuple[str, ...]
    after: Phase
    reason: str  # whose reason the phase has: a reaction's, "outdated", "stop", "kept" (that of before); empty: none
    because: str


def bits(conditions: Iterable[str]) -> int:
    """Return the `conditions` that hold as one number."""
    return sum([BITS[name] for name in conditions])


def _read(row: dict[str, str]) -> Transition:
    conditions = row["if"].split()
    before = PILOT_PHASES if row["from"] == "*" else map(Phase, row["from"].split())
    required = tuple([name for name in conditions if not name.startswith("!")])
    forbidden = tuple([name[1:] for name in conditions if name.startswith("!")])
    return Transition(frozenset(before), required, forbidden, Phase(row["to"]), row["reason"], row["because"])


@cache
def transitions() -> tuple[Transition, ...]:
    """Return the table's rows."""
    text = (files("flockwire_core.pilot") / "transitions.csv").read_text(encoding="utf-8")
    return tuple(_read(row) for row in csv.DictReader(text.splitlines()))


@cache
def transition(phase: Phase, conditions: int) -> Transition:
    """Return the row by which a pilot in `phase` goes on under the `conditions` that hold (`bits`)."""
    rows = (row for row in transitions() if phase in row.before and not bits(row.required) & ~conditions)
    return next(row for row in rows if not bits(row.forbidden) & conditions)


@cache
def reachable(phases: frozenset[Phase], possible: frozenset[int]) -> frozenset[Phase]:
    """Return the phases that one step leads to, from any of `phases` under any of the `possible` conditions."""
    return frozenset(transition(phase, conditions).after for phase in phases for conditions in possible)


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
