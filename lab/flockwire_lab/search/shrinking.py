"""Shrinks a flight that violates a property: fewer faults, drones, conditions; shorter."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from copy import deepcopy
from dataclasses import replace
from typing import Any

from flockwire_lab.search.flight import Case, Judged
from flockwire_lab.study.variation import Table

PARTS = ("orders", "processes")  # of a fault
MOST = 200  # flights
CONDITIONS = ("sim", "airframes", "obstacles", "checks")  # tables of the swarm file that a flight may not need

Fly = Callable[[Case], Judged]


def shrunk(case: Case, name: str, fly: Fly, most: int = MOST) -> tuple[Case, int]:
    """Return the smallest case found that violates property `name`, and the number of flights that it took."""
    flights = 0
    changed = True
    while changed:
        changed = False
        for smaller in _smaller(case):
            if flights >= most:
                return case, flights
            flights += 1
            if _shows(fly(smaller), name):
                case, changed = smaller, True
                break
    return case, flights


def _shows(judged: Judged, name: str) -> bool:
    margin = judged.margins.get(name)
    return margin is not None and margin.violated


def _smaller(case: Case) -> Iterator[Case]:
    """Yield smaller flights, the most hopeful first."""
    for faults in _less(case.faults):
        yield replace(case, faults=faults)
    for key in CONDITIONS:
        if case.table.get(key):
            yield replace(case, table={k: v for k, v in case.table.items() if k != key})
    for sim in _less(list(case.table.get("sim", {}).items())):
        yield replace(case, table={**case.table, "sim": dict(sim)})
    for drone in reversed(case.table["drones"][1:]):
        yield replace(case, table=_without(case.table, drone["id"]))
    yield from (replace(case, duration=round(one, 2)) for one in (case.duration / 2, case.duration - 1) if one >= 1)
    if case.seed:
        yield replace(case, seed=0)
    for place, fault in enumerate(case.faults):
        for key in PARTS:
            for part in _less(list(fault.get(key, ()))) if len(fault.get(key, ())) > 1 else ():
                yield replace(case, faults=[*case.faults[:place], fault | {key: part}, *case.faults[place + 1 :]])


def _less(items: list[Any]) -> Iterator[list[Any]]:
    """Yield `items` without each one, the last first."""
    yield from ([*items[:k], *items[k + 1 :]] for k in reversed(range(len(items))))


def _without(table: Table, drone: int) -> Table:
    """Return the swarm without a drone: who received from it receives from those that it received from."""
    table = deepcopy(table)
    table["drones"] = [one for one in table["drones"] if one["id"] != drone]
    edges = table["graph"]["edges"]
    before, after = [a for a, b, *_ in edges if b == drone], [b for a, b, *_ in edges if a == drone]
    kept = [edge for edge in edges if drone not in edge[:2]]
    known = {tuple(edge[:2]) for edge in kept}
    kept += [[a, b] for a in before for b in after if (a, b) not in known and a != b]
    table["graph"]["edges"] = kept
    return table
