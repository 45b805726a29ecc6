"""The page of a pilot's phases, from core/flockwire_core/pilot/transitions.csv."""

from __future__ import annotations

from flockwire_core.pilot.transitions import CONDITIONS, PHASES, Transition, transitions

HEAD = """# Phases of a pilot

<!-- made by scripts/document from core/flockwire_core/pilot/transitions.csv; change that -->

A pilot (an agent, or the leader) is in one of seven phases. At each step, the first row of the table that names its
phase, and whose conditions hold, gives the next phase. The same table is the specification for three programs: a test
compares the code with it, the model in `lab/model/` explores all states of several pilots, and the check "conformance"
replays every flight through it ([checks](../checks.md)).

![Phases and transitions; the numbers are those of the table](../images/phases.svg)

*Rows that stay in the phase are not drawn.*

| row | from | if | to | because |
|---|---|---|---|---|
"""
CONDITIONS_HEAD = """
## Conditions

| condition | holds if |
|---|---|
"""
TAIL = """
"Something" is a rung of the staleness ladder ([safety](../safety.md)): each input that a pilot loses, and each limit
that it leaves, has its own time until the pilot slows, holds or lands. The pilot's status gives the reason.
"""


def phases_page() -> str:
    """Return the page."""
    rows = "".join(_row(number, one) for number, one in enumerate(transitions(), 1))
    conditions = "".join(f"| `{name}` | {text} |\n" for name, text in CONDITIONS.items())
    return HEAD + rows + CONDITIONS_HEAD + conditions + TAIL


def _row(number: int, one: Transition) -> str:
    before = "any" if one.before == frozenset(PHASES) else ", ".join(str(p) for p in PHASES if p in one.before)
    names = [*(f"`{name}`" for name in CONDITIONS if name in one.required)]
    names += [f"not `{name}`" for name in CONDITIONS if name in one.forbidden]
    return f"| {number} | {before} | {', '.join(names)} | {one.after} | {one.because} |\n"
