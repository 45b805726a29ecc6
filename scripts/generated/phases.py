"""The page of a pilot's two tables: core/flockwire_core/pilot/transitions.csv and reactions.py."""

from __future__ import annotations

import re
from operator import attrgetter

from flockwire_core.pilot.phases import CONDITIONS, Transition, transitions
from flockwire_core.pilot.reactions import EVERY, INPUTS, REACTIONS, TABLE, Row
from flockwire_core.swarm.tables import Limits
from flockwire_core.wire.phase import PILOT_PHASES

HEAD = """# Phases and reactions of a pilot

<!-- made by scripts/document from core/flockwire_core/pilot/transitions.csv and reactions.py; change those -->

A pilot (an agent, or the leader) decides by two tables. At each step the table of reactions gives what keeps it from
flying, with the reason. Then the first row of the table of phases that names its phase, and whose conditions hold,
gives the next phase. The model in `lab/model/` explores the same table of phases for several pilots, and the check
"conformance" replays every flight through it ([checks](../checks.md)).

![Phases and transitions; the numbers are those of the table](../images/phases.svg)

*Rows that stay in the phase are not drawn.*

| row | from | if | to | reason in the status | because |
|---|---|---|---|---|---|
"""
CONDITIONS_HEAD = """
## Conditions

| condition | holds if |
|---|---|
"""
REACTIONS_HEAD = """
## Reactions

The first row of each reaction counts that names the phase, and whose input is beyond its limit. The status then has its
text as the reason, and the row's input and reaction as its code. `refuse` makes `unready` hold, `hold` makes
`disturbed`, `land` makes `danger`.

| reaction | what the pilot does |
|---|---|
"""
TABLE_HEAD = """
Limits without a table are in `[limits.staleness]`.

| reaction | input | limit | phases | reason |
|---|---|---|---|---|
"""
INPUTS_HEAD = """
| input | value |
|---|---|
"""


def phases_page() -> str:
    """Return the page."""
    rows = "".join(_row(number, one) for number, one in enumerate(transitions(), 1))
    conditions = "".join(f"| `{name}` | {text} |\n" for name, text in CONDITIONS.items())
    reactions = "".join(f"| {name} | {text} |\n" for name, text in REACTIONS.items())
    inputs = "".join(f"| {name} | {text} |\n" for name, text in INPUTS.items())
    table = "".join(map(_reaction, TABLE))
    return (
        HEAD
        + rows
        + CONDITIONS_HEAD
        + conditions
        + REACTIONS_HEAD
        + reactions
        + TABLE_HEAD
        + table
        + INPUTS_HEAD
        + inputs
    )


def _reaction(row: Row) -> str:
    if isinstance(row.limit, float):
        limit = f"{row.limit:g}"
    else:
        name = row.limit.removeprefix("staleness.")
        shown = name if name != row.limit else f"limits.{name}"
        limit = f"`{shown}` ({attrgetter(row.limit)(Limits()):g})"
    phases = "any" if row.phases == EVERY else ", ".join(str(phase) for phase in PILOT_PHASES if phase in row.phases)
    text = re.sub(r":[^}]*}", "}", row.text)  # without the formats of its values
    return f"| {row.reaction} | {row.input} | {'below' if row.below else 'above'} {limit} | {phases} | {text} |\n"


def _row(number: int, one: Transition) -> str:
    before = (
        "any" if one.before == frozenset(PILOT_PHASES) else ", ".join(str(p) for p in PILOT_PHASES if p in one.before)
    )
    names = [*(f"`{name}`" for name in CONDITIONS if name in one.required)]
    names += [f"not `{name}`" for name in CONDITIONS if name in one.forbidden]
    return f"| {number} | {before} | {', '.join(names)} | {one.after} | {one.reason} | {one.because} |\n"
