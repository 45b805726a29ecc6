"""One run of a study: its swarm and faults, drawn by a seed."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from copy import deepcopy
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from random import Random
from typing import Any

from flockwire_core.loading import SwarmFileError, framed_tables, load_table, parse_swarm
from flockwire_core.swarm.model import Swarm
from flockwire_core.wire.plan import Plan
from pydantic import JsonValue

from flockwire_lab.faults.file import FaultFileError, parse_faults
from flockwire_lab.faults.injection import refusal
from flockwire_lab.faults.kinds import Fault
from flockwire_lab.study.draws import random_edges, random_starts
from flockwire_lab.study.file import Draw, GridPoint, Study, StudyError

Table = dict[str, Any]
Chance = Callable[[str], Random]


@dataclass(frozen=True, slots=True)
class Variation:
    """A swarm as a table and as a model, faults likewise, and the values drawn from [random] by key."""

    table: Table
    swarm: Swarm
    fault_table: Table
    faults: tuple[Fault, ...]
    drawn: dict[str, JsonValue]


def vary(plan: Study, table: Table, point: GridPoint, seed: int, chance: Chance | None = None) -> Variation:
    """Return the run of `seed` at a grid point; raises StudyError if its values are refused.

    `chance` returns the source of the random values of a key, of "starts", "graph" or "fault K" (default: by the seed).
    """
    chance = chance or partial(_chance, seed)
    drawn = {key: draw.value(chance(key)) for key, draw in plan.random.items()}
    return _build(plan, table, [*point, *drawn.items()], chance, drawn)


def swarm_table(path: Path) -> Table:
    """Return the swarm file's content with absolute paths of key frames and of the folder of own laws.

    Raises SwarmFileError.
    """
    table: Table = load_table(path)
    table.setdefault("folder", str(path.absolute().parent))
    for _, framed in framed_tables(table):
        framed["file"] = str((path.parent / str(framed["file"])).resolve())
    return table


def rehearse(plan: Study, table: Table) -> None:
    """Try the first run of each grid point, and each range's ends; raises StudyError for refused values."""
    for point in plan.points:
        vary(plan, table, point, plan.seed_of(0))
    first = list(plan.points[0])
    for key, draw in plan.random.items():
        for value in draw.extremes():
            _build(plan, table, [*first, (key, value)], partial(_chance, plan.seed_of(0)), {})
    swarm = _swarm(table)
    for place, fault in enumerate(plan.faults):
        for change in _extremes(fault.table):
            _faults({"faults": [change]}, swarm, f"faults.{place} of the study")


def _build(
    plan: Study, table: Table, values: list[tuple[str, JsonValue]], chance: Chance, drawn: dict[str, JsonValue]
) -> Variation:
    varied = deepcopy(table)
    for key, value in values:
        _put(varied, key, value)
    swarm = _swarm(varied)
    if plan.starts is not None:
        places = random_starts(swarm, plan.starts, chance("starts"))
        for drone, place in zip(varied["drones"], places, strict=True):
            drone["start"] = [*place, drone["start"][2]]
    if plan.graph is not None:
        varied.setdefault("graph", {})["edges"] = random_edges(swarm, plan.graph, chance("graph"))
    if plan.starts is not None or plan.graph is not None:
        swarm = _swarm(varied)
    fault_table = {"faults": _drawn_faults(plan, chance)}
    return Variation(varied, swarm, fault_table, _faults(fault_table, swarm, "the study's faults"), drawn)


def _drawn_faults(plan: Study, chance_of: Chance) -> list[Table]:
    happen: list[Table] = []
    for place, fault in enumerate(plan.faults):
        chance = chance_of(f"fault {place}")
        if chance.random() < fault.probability:
            values = fault.table.items()
            happen.append({key: v.value(chance) if isinstance(v, Draw) else v for key, v in values})
    return sorted(happen, key=lambda fault: fault["at"] if isinstance(fault.get("at"), int | float) else 0.0)


def _extremes(table: dict[str, Any]) -> Iterator[Table]:
    plain = {key: v.extremes()[0] if isinstance(v, Draw) else v for key, v in table.items()}
    yield plain
    for key, value in table.items():
        if isinstance(value, Draw):
            yield from ({**plain, key: end} for end in value.extremes())


def _put(table: Table, key: str, value: JsonValue) -> None:
    """Set the value at a dotted key; numbers are list positions."""
    *path, last = key.split(".")
    inner: Any = table
    try:
        for part in path:
            inner = inner[int(part)] if isinstance(inner, list) else inner.setdefault(part, {})
        if isinstance(inner, list):
            inner[int(last)] = deepcopy(value)
        elif isinstance(inner, dict):
            inner[last] = deepcopy(value)
        else:
            raise TypeError
    except (ValueError, IndexError, TypeError, AttributeError):
        raise StudyError(f"{key} = {value!r}: the swarm file has no such key") from None


def _swarm(table: Table) -> Swarm:
    try:
        return parse_swarm(table, "the varied swarm")
    except SwarmFileError as error:
        raise StudyError(str(error)) from None


def _faults(table: Table, swarm: Swarm, origin: str) -> tuple[Fault, ...]:
    try:
        faults = parse_faults(table, wiring := Plan(swarm.in_simulation()), origin)
    except FaultFileError as error:
        raise StudyError(str(error)) from None
    if cannot := refusal(faults, wiring):
        raise StudyError("\n".join(f"{origin}: {line}" for line in cannot.split("\n")))
    return faults


def _chance(seed: int, what: str) -> Random:
    return Random(f"study {seed} {what}")  # noqa: S311  (not for secrets)
