"""Draws one fault of a given kind for a swarm; keys as in a file of faults."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Mapping
from itertools import permutations
from random import Random
from typing import Any

from flockwire_core.wire.plan import Plan

from flockwire_lab.faults.targets import targets
from flockwire_lab.search.events import SECOND_STATION, STATION_FROZEN, STATION_LOST, STOP, TOLD_TO_END
from flockwire_lab.study.variation import Table

FAULT_KINDS = (
    "kill", "restart", "freeze", "cut", "partition", "link", "tracker", "noise", "clock", "lag", "failure",
    STOP, TOLD_TO_END, STATION_FROZEN, STATION_LOST,
)  # fmt: skip
SEARCHED_KINDS = (*FAULT_KINDS, "swap", SECOND_STATION)
ENDING_KINDS = ("restart", "freeze", "cut", "partition", "link", "tracker", "noise", "swap")  # those that end
Draw = Callable[[Plan, Random], Table]
LASTING = ("freeze", "cut", "partition", "link", "tracker", "noise", STATION_FROZEN, "swap")


def random_fault(kind: str, plan: Plan, duration: float, chance: Random) -> dict[str, Any]:
    """Return a fault of `kind` in a flight of `duration` s from the order to take off to the order to land."""
    if kind == SECOND_STATION:
        return second_station(duration, chance)
    lasting = round(min(8.0, 0.3 * (8.0 / 0.3) ** chance.random()), 3)  # s, as often short as long
    fault: dict[str, Any] = {"at": round(chance.uniform(0.0, duration + 1.0), 3), "kind": kind}
    if kind in LASTING:
        fault["duration"] = round(chance.uniform(0.3, 8.0), 3) if kind == "cut" else lasting
    for draw in DRAWS.get(kind, ()):
        fault |= draw(plan, chance)
    return fault


def second_station(duration: float, chance: Random) -> dict[str, Any]:
    """Return the orders of another station, each some s after the one before."""
    verbs = chance.choices(("hold", "land", "start"), (0.4, 0.3, 0.3), k=chance.randint(1, 3))
    orders = [(round(chance.uniform(0.02, 2.0), 3), verb) for verb in verbs]
    return {"at": round(chance.uniform(0.0, duration), 3), "kind": SECOND_STATION, "orders": orders}


def _process(plan: Plan, chance: Random) -> Table:
    """Return a process, of each kind as often."""
    kinds: dict[str, list[str]] = defaultdict(list)
    for identity in targets(plan):
        kinds[plan.rows[identity].kind].append(identity)
    return {"process": chance.choice(kinds[chance.choice(tuple(kinds))])}


def _link(plan: Plan, chance: Random) -> Table:
    """Return a link, of each two kinds of process as often."""
    links: dict[tuple[str, str], list[tuple[str, str]]] = defaultdict(list)
    for a, b in permutations(targets(plan), 2):
        if plan.between(a, b):
            links[plan.rows[a].kind, plan.rows[b].kind].append((a, b))
    return dict(zip(("from", "to"), chance.choice(links[chance.choice(tuple(links))]), strict=True))


def _drone(plan: Plan, chance: Random) -> Table:
    return {"drone": chance.choice(plan.swarm.flying)}


def _up_to(**most: float) -> Draw:
    """Return what draws a value of each key, up to the largest."""
    return lambda _, chance: {key: chance.uniform(0.0, value) for key, value in most.items()}


def _step(_: Plan, chance: Random) -> Table:
    reach = chance.choice((0.2, 5.0))
    return {"step": chance.uniform(-reach, reach)}


DRAWS: Mapping[str, tuple[Draw, ...]] = {  # the keys that only some kinds have
    "kill": (_process,),
    "restart": (_process,),
    "freeze": (_process,),
    "clock": (_process, _step),
    "cut": (_link,),
    "link": (_link, _up_to(delay=0.3, jitter=0.1, loss=0.6, reordering=0.2)),
    "partition": (lambda plan, chance: {"processes": chance.sample(targets(plan), chance.randint(1, 3))},),
    "noise": (lambda _, chance: {"noise": chance.uniform(0.002, 0.03)},),
    "tracker": (_drone,),
    "failure": (_drone,),
    "lag": (_drone, _up_to(lag=0.3, dead_time=0.1)),
    "swap": (lambda plan, chance: {"drones": chance.sample(plan.swarm.flying, 2)},),
    TOLD_TO_END: (lambda plan, chance: {"process": chance.choice(list(plan.pilots.values()))},),
}
