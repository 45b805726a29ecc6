"""What is left of a table when its wrong values are taken out, so that the rules can look at the rest."""

from __future__ import annotations

import json
from copy import deepcopy
from typing import Any

from pydantic import ValidationError

from flockwire.swarm.model import Swarm
from flockwire.swarm.outline import place

ROUNDS = 8  # a value that is taken out may leave its table incomplete, and that one its own
_PLACE = [0.0, 0.0, 0.0]
_STAND_INS: dict[str, Any] = {
    "name": "swarm", "graph": {"edges": []}, "edges": [], "drones": [], "id": 1, "start": _PLACE, "center": _PLACE,
}  # fmt: skip


def validated(table: dict[str, Any]) -> Swarm:
    """Return a file's content as a model; raises ValidationError."""
    return Swarm.model_validate_json(json.dumps(table, default=str))


def mended(table: dict[str, Any]) -> Swarm | None:
    """Return `table` as a model after what is wrong has given way to defaults and stand-ins; None if it cannot."""
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
    """Take out what stands at `keys`, or fill in what is missing there; without a stand-in its whole table goes."""
    *path, last = keys
    inner: Any = table
    for key in path:
        try:
            inner = inner[key]
        except (KeyError, IndexError, TypeError):
            return  # gone with another one
    if isinstance(inner, dict) and missing and last in _STAND_INS:
        inner[str(last)] = deepcopy(_STAND_INS[str(last)])
    elif isinstance(inner, dict) and last in inner:
        del inner[str(last)]
    elif path:
        _take_out(table, tuple(path), missing=False)
