"""Shrinks a flight that violates a property: fewer faults, drones, conditions; shorter."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from copy import deepcopy
from dataclasses import replace
from itertools import product
from typing import Any

from flockwire_lab.search.flight import Case, Judged
from flockwire_lab.study.variation import Table

PARTS = ("orders", "processes")  # of a fault
CONDITIONS = ("sim", "airframes", "obstacles", "checks")  # tables of the swarm file that a flight may not need

Fly = Callable[[Case], Judged]


def shrunk(case: Case, name: str, fly: Fly, most: int = 200) -> tuple[Case, int]:
    """Return the smallest case found that violates property `name`, and the number of flights that it took."""
    flights = 0
    while True:
        for smaller in _smaller(case):
            if flights >= most:
                return case, flights
            flights += 1
            margin = fly(smaller).margins.get(name)
            if margin is not None and margin.violated:
                case = smaller
                break
        else:
            return case, flights


def _smaller(case: Case) -> Iterator[Case]:
    """Yield smaller flights, the most hopeful first."""
    yield from (replace(case, faults=faults) for faults in _less(case.faults))
    yield from (replace(case, table=table) for table in _smaller_tables(case.table))
    yield from (replace(case, duration=round(one, 2)) for one in (case.duration / 2, case.duration - 1) if one >= 1)
    if case.seed:
        yield replace(case, seed=0)
    for place, fault in enumerate(case.faults):
        for key in PARTS:
            parts = list(fault.get(key, ()))
            for part in _less(parts) if len(parts) > 1 else ():
                yield replace(case, faults=[*case.faults[:place], fault | {key: part}, *case.faults[place + 1 :]])


def _smaller_tables(table: Table) -> Iterator[Table]:
    """Yield the swarm without a table that a flight may not need, then without a condition, then without a drone."""
    yield from ({k: v for k, v in table.items() if k != key} for key in CONDITIONS if table.get(key))
    yield from ({**table, "sim": dict(sim)} for sim in _less(list(table.get("sim", {}).items())))
    yield from (_without(table, drone["id"]) for drone in reversed(table["drones"][1:]))


def _less(items: list[Any]) -> Iterator[list[Any]]:
    """Yield `items` without each one, the last first."""
    yield from ([*items[:k], *items[k + 1 :]] for k in reversed(range(len(items))))


def _without(table: Table, drone: int) -> Table:
    """Return the swarm without a drone: who received from it receives from those that it received from."""
    table = deepcopy(table)
    table["drones"] = [one for one in table["drones"] if one["id"] != drone]
    edges = {(a, b): [a, b, *rest] for a, b, *rest in table["graph"]["edges"]}
    before, after = ([edge for edge in edges if edge[end] == drone] for end in (1, 0))
    for (a, _), (_, b) in product(before, after):
        edges.setdefault((a, b), [a, b])
    table["graph"]["edges"] = [edge for (a, b), edge in edges.items() if drone not in (a, b) and a != b]
    return table
