"""The phases of a pilot as a table: transitions.csv, one row for each transition.

The first row that names the phase, and whose conditions hold, gives the next phase; `!` means: does not hold. The
table is the specification: a test compares the code with it (FlightPhases), the model checks it (model/), and analysis
replays every flight through it.
"""

from __future__ import annotations

import csv
from collections.abc import Set as AbstractSet
from functools import cache
from importlib.resources import files
from typing import NamedTuple

from flockwire_core.wire.phase import Phase

PHASES = (
    Phase.GROUNDED, Phase.READY, Phase.TAKEOFF, Phase.HOLD, Phase.FORMATION, Phase.LANDING, Phase.STOPPED,
)  # fmt: skip
CONDITIONS = {
    "stop": "an emergency stop was received",
    "airborne": "the airframe flies, by the telemetry that the pilot has",
    "high": "it is at take-off height or above",
    "unready": "something keeps it from taking off",
    "disturbed": "something keeps it from the formation, or the formation's time 0 is still to come",
    "danger": "something forbids to fly: the ladder, the end of its process, or no order for a long time",
    "up": "the order that holds takes up from the ground",
    "outdated": "that order is from before the process began, or the drone came down since",
    "formation": "the order that holds is to fly a formation",
    "landing": "the order that holds is to land",
}
Conditions = frozenset[str]  # those that hold


class Transition(NamedTuple):
    """One row: from any phase of `before`, while `required` hold and none of `forbidden` does, `after` follows."""

    before: frozenset[Phase]
    required: Conditions
    forbidden: Conditions
    after: Phase
    because: str

    def applies(self, phase: Phase, conditions: AbstractSet[str]) -> bool:
        """Return whether it leads on from `phase` under the `conditions` that hold."""
        return phase in self.before and self.required <= conditions and self.forbidden.isdisjoint(conditions)


def _read(row: dict[str, str]) -> Transition:
    conditions = row["if"].split()
    before = PHASES if row["from"] == "*" else map(Phase, row["from"].split())
    required = frozenset(name for name in conditions if not name.startswith("!"))
    forbidden = frozenset(name[1:] for name in conditions if name.startswith("!"))
    return Transition(frozenset(before), required, forbidden, Phase(row["to"]), row["because"])


@cache
def transitions() -> tuple[Transition, ...]:
    """Return the table's rows."""
    text = (files("flockwire_core.pilot") / "transitions.csv").read_text(encoding="utf-8")
    return tuple(_read(row) for row in csv.DictReader(text.splitlines()))


def transition(phase: Phase, conditions: AbstractSet[str]) -> Transition:
    """Return the row by which a pilot in `phase` goes on under the `conditions` that hold."""
    return next(row for row in transitions() if row.applies(phase, conditions))


@cache
def reachable(phases: frozenset[Phase], possible: frozenset[Conditions]) -> frozenset[Phase]:
    """Return the phases that one step leads to, from any of `phases` under any of the `possible` conditions."""
    return frozenset(transition(phase, conditions).after for phase in phases for conditions in possible)
