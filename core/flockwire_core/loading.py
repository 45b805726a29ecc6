"""Reads swarm files: TOML in, one checked model out. The only place that applies the rules.

It is above `swarm` and `wire` because some rules concern addresses, which only the plan knows.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from copy import deepcopy
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from flockwire_core.objects import load_object
from flockwire_core.own_law import law_failures, law_problems
from flockwire_core.swarm import airframe_rules, formation_rules, gateway_rules, ros_rules, rules
from flockwire_core.swarm.airframes import AIRFRAMES
from flockwire_core.swarm.model import Swarm
from flockwire_core.swarm.outline import place
from flockwire_core.swarm.reading import error_lines, faults, read_text, read_toml
from flockwire_core.swarm.rules import broken
from flockwire_core.wire import address_rules

ROUNDS = 8  # a removed value may leave its table incomplete, and this table its parent
_PLACE = [0.0, 0.0, 0.0]
_STAND_INS: dict[str, Any] = {
    "name": "swarm", "graph": {"edges": []}, "edges": [], "drones": [], "id": 1, "start": _PLACE, "center": _PLACE,
}  # fmt: skip


class SwarmFileError(ValueError):
    """A swarm file that cannot be flown; each line of the text names one key, its value and the rule."""


def load_swarm(path: Path) -> Swarm:
    """Read and check a swarm file.

    Raises SwarmFileError with one line for each problem: file, key, value, rule.
    """
    return parse_swarm(load_table(path), str(path))


def read_swarm(path: Path) -> Swarm:
    """Read a swarm file without its rules, for orders to a flying swarm.

    Raises SwarmFileError if it is not a swarm file.
    """
    try:
        return _validated(load_table(path))
    except ValidationError as error:
        raise SwarmFileError("\n".join(f"{path}: {line}" for line in error_lines(error, Swarm))) from None


def load_table(path: Path) -> dict[str, object]:
    """Read a swarm file and its key frames without a check; raises SwarmFileError if it cannot be read.

    The table says in which folder an own law is searched.
    """
    table = read_toml(path, "swarm file", SwarmFileError)
    if isinstance(control := table.get("control"), dict) and ":" in str(control.get("law")):
        table.setdefault("folder", str(path.absolute().parent))
    for name, framed in framed_tables(table):
        framed["frames"] = _read_key_frames(path, name, str(framed["file"]))
    return table


def framed_tables(table: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield the tables of a swarm file that name a file of key frames, each with its key."""
    leading = [("leader.trajectory", inner) for key, inner in _tables(table, "leader") if key == "leader.trajectory"]
    for key, inner in [("formation", table.get("formation")), *_tables(table, "formations"), *leading]:
        if isinstance(inner, dict) and inner.get("kind") == "key_frames" and "file" in inner:
            yield key, inner


def parse_swarm(table: dict[str, object], origin: str) -> Swarm:
    """Check the swarm file's content `table`, which came from `origin`; raises SwarmFileError."""
    try:
        swarm: Swarm | None = _validated(table)
        lines: list[str] = []
        wrong: set[str] = set()
    except ValidationError as error:
        found = list(faults(error, Swarm))
        lines, wrong = [fault.line for fault in found], {key for fault in found for key in fault.taints}
        swarm = _mended(table)
    if swarm is not None:
        lines += problems(swarm, wrong=wrong)
        if not lines:
            return swarm
    raise SwarmFileError("\n".join(f"{origin}: {line}" for line in dict.fromkeys(lines)))


def _validated(table: dict[str, Any]) -> Swarm:
    """Return a file's content as a model; raises ValidationError."""
    return Swarm.model_validate_json(json.dumps(table, default=str))


def _mended(table: dict[str, Any]) -> Swarm | None:
    """Return `table` as a model with wrong values replaced by defaults and stand-ins; None if impossible.

    The rules can then check the rest.
    """
    rest = deepcopy(table)
    for _ in range(ROUNDS):
        try:
            return _validated(rest)
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


def problems(swarm: Swarm, to_fly: bool = True, wrong: set[str] | None = None) -> Iterator[str]:
    """Yield one line per problem, `key = value: rule`; a rule that depends on a `wrong` key is skipped.

    For a swarm that is not `to_fly`, because it has flown, no law is imported; it may be missing here.
    """
    own = (rule for row in AIRFRAMES if row.rules for rule in load_object(row.rules))
    later = (*airframe_rules.RULES, *gateway_rules.RULES, *ros_rules.RULES)
    of_files = (*rules.RULES, *formation_rules.RULES, *own, *later)
    of_laws = (law_problems, law_failures) if to_fly else ()
    yield from broken(swarm, (*of_files, *address_rules.RULES, *of_laws), wrong if wrong is not None else set())


def _tables(table: dict[str, object], key: str) -> list[tuple[str, object]]:
    inner = table.get(key)
    return [(f"{key}.{name}", value) for name, value in inner.items()] if isinstance(inner, dict) else []


def _read_key_frames(swarm_file: Path, key: str, name: str) -> str:
    try:
        return read_text(swarm_file.parent / name)
    except (OSError, ValueError) as error:
        raise SwarmFileError(f"{swarm_file}: {key}.file = {name!r}: cannot read it: {error}") from error
