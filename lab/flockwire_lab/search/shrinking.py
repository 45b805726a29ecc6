"""Shrinks a flight that violates a property: fewer faults, drones, conditions; shorter."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from copy import deepcopy
from dataclasses import replace

from flockwire_lab.search.flight import Case, Judged
from flockwire_lab.study.variation import Table

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
    for place in reversed(range(len(case.faults))):
        yield replace(case, faults=[fault for k, fault in enumerate(case.faults) if k != place])
    for key in CONDITIONS:
        if case.table.get(key):
            yield replace(case, table={k: v for k, v in case.table.items() if k != key})
    for key in list(case.table.get("sim", {})):
        yield replace(case, table={**case.table, "sim": {k: v for k, v in case.table["sim"].items() if k != key}})
    for drone in reversed(case.table["drones"][1:]):
        yield replace(case, table=_without(case.table, drone["id"]))
    for shorter in (case.duration / 2.0, case.duration - 1.0):
        if shorter >= 1.0:
            yield replace(case, duration=round(shorter, 2))
    if case.seed:
        yield replace(case, seed=0)
    yield from _smaller_faults(case)


def _smaller_faults(case: Case) -> Iterator[Case]:
    for place, fault in enumerate(case.faults):
        if len(fault.get("orders", ())) > 1:
            for k in range(len(fault["orders"])):
                orders = [order for n, order in enumerate(fault["orders"]) if n != k]
                yield replace(case, faults=_with(case.faults, place, fault | {"orders": orders}))
        if len(fault.get("processes", ())) > 1:
            for process in fault["processes"]:
                rest = [other for other in fault["processes"] if other != process]
                yield replace(case, faults=_with(case.faults, place, fault | {"processes": rest}))


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


def _with(faults: list[Table], place: int, fault: Table) -> list[Table]:
    return [fault if k == place else other for k, other in enumerate(faults)]
