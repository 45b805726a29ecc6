"""One run of a study: its swarm and faults, drawn by a seed."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from copy import deepcopy
from functools import partial
from itertools import product
from math import dist
from pathlib import Path
from random import Random
from typing import Any, NamedTuple

from flockwire_core.loading import framed_tables, load_table, parse_swarm
from flockwire_core.swarm.model import Swarm
from flockwire_core.swarm.wording import InputError
from flockwire_core.wire.plan import Plan
from pydantic import JsonValue

from flockwire_lab.faults.injection import possible_faults
from flockwire_lab.faults.kinds import Fault
from flockwire_lab.study.file import Draw, GridPoint, RandomGraph, Starts, Study

VARIED = "the varied swarm"  # where its problems are
Table = dict[str, Any]
Chance = Callable[[str], Random]


class Variation(NamedTuple):
    """A swarm as a table and as a model, faults likewise, and the values drawn from [random] by key."""

    table: Table
    swarm: Swarm
    fault_table: Table
    faults: tuple[Fault, ...]
    drawn: dict[str, JsonValue]


def vary(plan: Study, table: Table, point: GridPoint, seed: int, chance: Chance | None = None) -> Variation:
    """Return the run of `seed` at a grid point; raises InputError if its values are refused.

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
    """Try the first run of each grid point, and each range's ends; raises InputError for refused values."""
    for point in plan.points:
        vary(plan, table, point, plan.seed_of(0))
    first = list(plan.points[0])
    for key, draw in plan.random.items():
        for value in draw.extremes():
            _build(plan, table, [*first, (key, value)], partial(_chance, plan.seed_of(0)), {})
    swarm = parse_swarm(table, VARIED)
    for place, fault in enumerate(plan.faults):
        for change in _extremes(fault.table):
            _faults({"faults": [change]}, swarm, f"faults.{place} of the study")


def _build(
    plan: Study, table: Table, values: list[tuple[str, JsonValue]], chance: Chance, drawn: dict[str, JsonValue]
) -> Variation:
    varied = deepcopy(table)
    for key, value in values:
        _put(varied, key, value)
    swarm = parse_swarm(varied, VARIED)
    if plan.starts is not None:
        places = random_starts(swarm, plan.starts, chance("starts"))
        for drone, place in zip(varied["drones"], places, strict=True):
            drone["start"] = [*place, drone["start"][2]]
    if plan.graph is not None:
        varied.setdefault("graph", {})["edges"] = random_edges(swarm, plan.graph, chance("graph"))
    if plan.starts is not None or plan.graph is not None:
        swarm = parse_swarm(varied, VARIED)
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
        inner[int(last) if isinstance(inner, list) else last] = deepcopy(value)
    except (ValueError, IndexError, TypeError, AttributeError):
        raise InputError(f"{key} = {value!r}: the swarm file has no such key") from None


def _faults(table: Table, swarm: Swarm, origin: str) -> tuple[Fault, ...]:
    return possible_faults(table, Plan(swarm.in_simulation()), origin)


def _chance(seed: int, what: str) -> Random:
    return Random(f"study {seed} {what}")  # noqa: S311  (not for secrets)


def random_starts(swarm: Swarm, starts: Starts, chance: Random) -> list[tuple[float, float]]:
    """Return the starts of the swarm's drones, m, in their order; raises InputError if the box is too full."""
    beginnings = 20
    unknown = set(starts.fixed) - set(swarm.flying)
    if unknown:
        raise InputError(f"starts.fixed = {list(starts.fixed)}: there is no drone {min(unknown)}")
    for _ in range(beginnings):
        if (places := _places(swarm, starts, chance)) is not None:
            return places
    raise InputError(
        f"starts.box = {list(starts.box)}: no room for {len(swarm.drones)} drones with starts.spacing = "
        f"{starts.spacing:g} m and starts.obstacle_spacing = {starts.obstacle_spacing:g} m"
    )


def _places(swarm: Swarm, starts: Starts, chance: Random) -> list[tuple[float, float]] | None:
    tries = 2000  # tries for one drone, until all are drawn again
    (x, y), (width, depth) = starts.centre, starts.box
    found = {drone.id: drone.start[:2] for drone in swarm.drones if drone.id in starts.fixed}
    for drone in swarm.drones:
        for _ in range(tries if drone.id not in starts.fixed else 0):
            place = (x + (chance.random() - 0.5) * width, y + (chance.random() - 0.5) * depth)
            if _free(place, found.values(), swarm, starts):
                found[drone.id] = place
                break
        if drone.id not in found:
            return None
    return [found[drone.id] for drone in swarm.drones]


def _free(place: tuple[float, float], taken: Iterable[tuple[float, float]], swarm: Swarm, starts: Starts) -> bool:
    return all(dist(place, other) >= starts.spacing for other in taken) and all(
        dist(place, obstacle.center[:2]) - obstacle.radius >= starts.obstacle_spacing for obstacle in swarm.obstacles
    )


def random_edges(swarm: Swarm, graph: RandomGraph, chance: Random) -> list[list[int]]:
    """Return edges [from, to]: random trees of bounded depth from the leaders, and others; raises InputError.

    The followers join in random order, each below any drone of the tree that is not at full depth.
    """
    followers = list(swarm.followers)
    chance.shuffle(followers)
    depth = dict.fromkeys(swarm.leaders or followers[:1], 0)
    edges = []
    for follower in followers[not swarm.leaders :]:
        above = chance.choice([drone for drone, hops in depth.items() if graph.depth is None or hops < graph.depth])
        depth[follower] = depth[above] + 1
        edges.append([above, follower])
    rest = [[i, j] for i, j in product(depth, followers) if i != j and [i, j] not in edges]
    if graph.extra_edges > len(rest):
        raise InputError(f"graph.extra_edges = {graph.extra_edges}: at most {len(rest)} are left beside the tree's")
    return sorted(edges + chance.sample(rest, graph.extra_edges))
