"""Draws one fault of a given kind for a swarm; keys as in a file of faults."""

from __future__ import annotations

from collections import defaultdict
from itertools import permutations
from random import Random
from typing import Any

from flockwire_core.wire.plan import Plan

from flockwire_lab.faults.targets import targets
from flockwire_lab.search.events import SECOND_STATION, STATION_FROZEN, STATION_LOST, STOP, TOLD_TO_END

WORLD_KINDS = ("kill", "restart", "freeze", "cut", "partition", "link", "tracker", "noise", "clock", "lag", "failure")
FAULT_KINDS = (*WORLD_KINDS, STOP, TOLD_TO_END, STATION_FROZEN, STATION_LOST)
SEARCHED_KINDS = (*FAULT_KINDS, "swap", SECOND_STATION)
ENDING_KINDS = ("restart", "freeze", "cut", "partition", "link", "tracker", "noise", "swap")  # those that end
LASTING = ("freeze", "cut", "partition", "link", "tracker", "noise", STATION_FROZEN, "swap")


def random_fault(kind: str, plan: Plan, duration: float, chance: Random) -> dict[str, Any]:
    """Return a fault of `kind` in a flight of `duration` s from the order to take off to the order to land."""
    if kind == SECOND_STATION:
        return second_station(duration, chance)
    lasting = round(min(8.0, 0.3 * (8.0 / 0.3) ** chance.random()), 3)  # s, as often short as long
    fault: dict[str, Any] = {"at": round(chance.uniform(0.0, duration + 1.0), 3), "kind": kind}
    if kind in LASTING:
        fault["duration"] = round(chance.uniform(0.3, 8.0), 3) if kind == "cut" else lasting
    if kind in ("tracker", "lag", "failure"):
        fault["drone"] = chance.choice(plan.swarm.flying)
    return fault | _keys(kind, plan, chance)


def second_station(duration: float, chance: Random) -> dict[str, Any]:
    """Return the orders of another station, each some s after the one before."""
    verbs = chance.choices(("hold", "land", "start"), (0.4, 0.3, 0.3), k=chance.randint(1, 3))
    orders = [(round(chance.uniform(0.02, 2.0), 3), verb) for verb in verbs]
    return {"at": round(chance.uniform(0.0, duration), 3), "kind": SECOND_STATION, "orders": orders}


def _keys(kind: str, plan: Plan, chance: Random) -> dict[str, Any]:
    """Return the keys that only some kinds have."""
    processes = list(targets(plan))
    kinds: dict[str, list[str]] = {plan.rows[identity].kind: [] for identity in processes}
    for identity in processes:
        kinds[plan.rows[identity].kind].append(identity)
    keys: dict[str, Any] = {}
    if kind in ("kill", "restart", "freeze", "clock"):
        keys["process"] = chance.choice(kinds[chance.choice(tuple(kinds))])
    match kind:
        case "cut" | "link":
            links: dict[tuple[str, str], list[tuple[str, str]]] = defaultdict(list)  # by the kinds at their ends
            for a, b in permutations(processes, 2):
                if plan.publishes_to(a, b):
                    links[plan.rows[a].kind, plan.rows[b].kind].append((a, b))
            keys["from"], keys["to"] = chance.choice(links[chance.choice(tuple(links))])
            if kind == "link":
                keys |= {"delay": chance.uniform(0.0, 0.3), "jitter": chance.uniform(0.0, 0.1)}
                keys |= {"loss": chance.uniform(0.0, 0.6), "reordering": chance.uniform(0.0, 0.2)}
        case "partition":
            keys["processes"] = chance.sample(processes, chance.randint(1, 3))
        case "noise":
            keys["noise"] = chance.uniform(0.002, 0.03)
        case "clock":
            reach = chance.choice((0.2, 5.0))
            keys["step"] = chance.uniform(-reach, reach)
        case "lag":
            keys |= {"lag": chance.uniform(0.0, 0.3), "dead_time": chance.uniform(0.0, 0.1)}
        case "swap":
            keys["drones"] = chance.sample(plan.swarm.flying, 2)
        case _ if kind == TOLD_TO_END:
            keys["process"] = chance.choice(list(plan.pilots.values()))
    return keys
