"""The phases of a pilot as a table: transitions.csv, one row for each transition.

The first row that names the phase, and whose conditions hold, gives the next phase and its reason; `!` means: does not
hold. FlightPhases flies the table, lab/model/ explores it, and the check "conformance" replays each flight by it.
"""

from __future__ import annotations

import csv
from collections.abc import Iterable
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
    before = PHASES if row["from"] == "*" else map(Phase, row["from"].split())
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
