"""The table of faults on their page, from the models."""

from __future__ import annotations

import inspect
from typing import get_args

from flockwire_lab.faults.kinds import Fault, FaultKind


def faults_table() -> str:
    """Return a row for each kind of fault: its keys, and what its model's docstring says."""
    rows = "".join(map(_row, get_args(Fault)))
    return "| kind | keys besides `at` and `kind` | what happens |\n|---|---|---|\n" + rows


def _row(model: type[FaultKind]) -> str:
    (kind,) = get_args(model.model_fields["kind"].annotation)
    keys = [field.alias or name for name, field in model.model_fields.items() if name not in ("at", "kind")]
    effect = " ".join(inspect.getdoc(model).split()) + (" Refused in a real flight." if model.sim_only else "")
    return f"| `{kind}` | {', '.join(f'`{key}`' for key in keys)} | {effect} |\n"
