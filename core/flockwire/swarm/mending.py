"""Removes the wrong values of a table, so that the rules can check the rest."""

from __future__ import annotations

import json
from copy import deepcopy
from typing import Any

from pydantic import ValidationError

from flockwire.swarm.model import Swarm
from flockwire.swarm.outline import place

ROUNDS = 8  # a removed value may leave its table incomplete, and this table its parent
_PLACE = [0.0, 0.0, 0.0]
_STAND_INS: dict[str, Any] = {
    "name": "swarm", "graph": {"edges": []}, "edges": [], "drones": [], "id": 1, "start": _PLACE, "center": _PLACE,
}  # fmt: skip


def validated(table: dict[str, Any]) -> Swarm:
    """Return a file's content as a model; raises ValidationError."""
    return Swarm.model_validate_json(json.dumps(table, default=str))


def mended(table: dict[str, Any]) -> Swarm | None:
    """Return `table` as a model with wrong values replaced by defaults and stand-ins; None if impossible."""
    rest = deepcopy(table)
    for _ in range(ROUNDS):
        try:
            return validated(rest)
        except ValidationError as error:
            for detail in reversed(error.errors()):
                keys = place(Swarm, detail["loc"]).keys
                if keys:
                    _take_out(rest, keys, detail["type"] == "missing")
    return None


def _take_out(table: dict[str, Any], keys: tuple[str | int, ...], missing: bool) -> None:
    """Remove the value at `keys`, or fill in a missing one; without a stand-in remove its whole table."""
    *path, last = keys
    inner: Any = table
    for key in path:
        try:
            inner = inner[key]
        except (KeyError, IndexError, TypeError):
            return  # removed with another one
    if isinstance(inner, dict) and missing and last in _STAND_INS:
        inner[str(last)] = deepcopy(_STAND_INS[str(last)])
    elif isinstance(inner, dict) and last in inner:
        del inner[str(last)]
    elif path:
        _take_out(table, tuple(path), missing=False)
