"""`flockwire compare-laws`: any number of laws from the same starts, one table."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

from flockwire_core.loading import parse_swarm
from flockwire_lab.study.file import Study, StudyError, load_study
from flockwire_lab.study.flight import Result
from flockwire_lab.study.law_table import CAPTION, rows, text, write
from flockwire_lab.study.ledger import Ledger
from flockwire_lab.study.variation import Table, rehearse, swarm_table

from flockwire_operator.cli.study import fly_missing, naming, place


def compare_laws(swarm: Path, laws: Sequence[str], options: Mapping[str, object], out: Path, jobs: int) -> int:
    """Fly the remaining runs, write and print the table; returns the exit status: 1 if it was stopped.

    Raises StudyError and SwarmFileError for bad input, OSError if `out` fails.
    """
    table = swarm_table(swarm)
    parse_swarm(table, str(swarm))
    controls = [_control(table, law) for law in laws]
    plan = load_study(None, dict(options) | {"grid": {"control": controls}}, Study)
    with naming(swarm):
        rehearse(plan, table)
    with place(jobs, "") as workers, Ledger(out, plan, table, Result) as ledger:
        stopped = fly_missing(plan, table, ledger, workers)
        found = rows(plan, ledger.results)
    print(f"{text(found)}\n\n{CAPTION}")
    print(f"flockwire: {', '.join(map(str, write(found, out)))}" + (f"; {stopped}" if stopped else ""))
    return 1 if stopped else 0


def _control(table: Table, text: str) -> dict[str, object]:
    """Return the table [control] for `LAW` or `LAW,PARAMETER=NUMBER,…`; the file's own law keeps its parameters."""
    law, *given = text.split(",")
    control = dict(table.get("control", {}))
    if law != control.get("law"):
        control.pop("parameters", None)
        control.pop("information", None)
    parameters = dict(control.get("parameters", {}))
    for one in given:
        name, _, value = one.partition("=")
        try:
            parameters[name.strip()] = json.loads(value)
        except ValueError:
            raise StudyError(f"LAW = {text!r}: must be LAW or LAW,PARAMETER=NUMBER, as consensus,gain=0.5") from None
    return control | {"law": law} | ({"parameters": parameters} if parameters else {})
