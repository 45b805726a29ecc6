"""Reads swarm files: TOML in, one checked model out. The only place that applies the rules.

It is above `swarm` and `wire` because some rules concern addresses, which only the plan knows.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from flockwire_core.objects import load_object
from flockwire_core.own_law import law_failures, law_problems
from flockwire_core.swarm import formation_rules, ros_rules, rules
from flockwire_core.swarm.airframes import AIRFRAMES
from flockwire_core.swarm.model import Swarm
from flockwire_core.swarm.reading import read_text, read_toml
from flockwire_core.swarm.rules import Rule
from flockwire_core.swarm.validation import validate
from flockwire_core.swarm.wording import InputError
from flockwire_core.wire import address_rules


class SwarmFileError(InputError):
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
    return validate(Swarm, load_table(path), str(path), SwarmFileError)


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
    """Yield the tables of a swarm file that name a file of key frames or of an airframe's figures, with their keys."""
    first = table.get("formation")
    formations = [("formation", first)] if isinstance(first, dict) else []
    for key, inner in [*formations, *_tables(table, "formations"), *_trajectories(table)]:
        if inner.get("kind") == "key_frames" and "file" in inner:
            yield key, inner
    yield from ((key, inner) for key, inner in _tables(table, "airframes") if "file" in inner)


def parse_swarm(table: dict[str, object], origin: str) -> Swarm:
    """Check the swarm file's content `table`, which came from `origin`; raises SwarmFileError."""
    swarm = validate(Swarm, table, origin, SwarmFileError)
    if found := problems(swarm):
        raise SwarmFileError("\n".join(f"{origin}: {line}" for line in found))
    return swarm


def problems(swarm: Swarm, to_fly: bool = True) -> list[str]:
    """Return one line per problem, `key = value: rule`, of the first stage of rules that finds one.

    For a swarm that is not `to_fly`, because it has flown, no law is imported; it may be missing here.
    """
    for stage in _stages(swarm, to_fly):
        if found := [problem for rule in stage for problem in rule(swarm)]:
            return list(dict.fromkeys(str(problem.of(swarm)) for problem in found))
    return []


def _stages(swarm: Swarm, to_fly: bool) -> Iterator[tuple[Rule, ...]]:
    """Yield the rules; those of a stage need that the ones before are kept. An airframe's are loaded if it flies."""
    own = (rule for row in AIRFRAMES if row.rules and swarm.of_kind(row) for rule in load_object(row.rules))
    yield rules.TABLES
    yield (*rules.RULES, *formation_rules.RULES, *own, *ros_rules.RULES)
    if to_fly:
        yield (law_problems,)  # addresses depend on what the law declares
    yield (*formation_rules.LATER, *address_rules.RULES)
    if to_fly:
        yield (law_failures,)


def _trajectories(table: dict[str, Any]) -> list[tuple[str, dict[str, Any]]]:
    """Return the tables of the trajectories of all leaders, and of those with a table of their own."""
    own = [(key, one) for key, one in _tables(table, "leader") if key.rpartition(".")[2].isdecimal()]
    leaders = [("leader", table.get("leader")), *own]
    found = [(f"{key}.trajectory", one.get("trajectory")) for key, one in leaders if isinstance(one, dict)]
    return [(key, one) for key, one in found if isinstance(one, dict)]


def _tables(table: dict[str, Any], key: str) -> list[tuple[str, dict[str, Any]]]:
    """Return the tables in the table `key`, with their keys."""
    inner = table.get(key)
    found = inner.items() if isinstance(inner, dict) else ()
    return [(f"{key}.{name}", value) for name, value in found if isinstance(value, dict)]


def _read_key_frames(swarm_file: Path, key: str, name: str) -> str:
    try:
        return read_text(swarm_file.parent / name)
    except (OSError, ValueError) as error:
        raise SwarmFileError(f"{swarm_file}: {key}.file = {name!r}: cannot read it: {error}") from error
