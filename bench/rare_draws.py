"""What `--rare` adds to a drawn flight: rare branches of the network, orders of two stations, rare faults.

The draws look for what no usual one reaches: an order at the moment of another one, a process that restarts as its
drone takes off, a start without a drone, a body with another's name, a person, a drone in a hand.
"""

from __future__ import annotations

from random import Random
from typing import Any

from flockwire.wire.plan import Plan

ORDERS = "orders"  # of one station, some s after an order was published (`on`; empty: the flight's beginning)
EARLY = "early"  # a process that is killed, or stands still, before the order to take off
HAND = "hand"  # a Tello in a hand
STATION_KILLED = "station killed"  # and nobody is told
WORLD_KINDS = ("swap", "visitor")  # which the simulated world injects
RARE_KINDS = (ORDERS, EARLY, HAND, STATION_KILLED, "swap", "visitor")
CONDUCTED = ("hold", "resume", "land", "stop")  # what the station may order that conducts the flight
ASKED = ("start", "start", "formation", "formation", "hold", "land", "stop")
SMALL_SHARE = 0.8  # of the flights of airframes without a driver of their own
SMALL, SLOW = 3, 20  # drones, steps a second: a tenth of the time
LONG = 36.0  # s, longer than the director waits


def alter(table: dict[str, Any], chance: Random) -> None:
    """Change the swarm file: a small swarm, other formations, and limits that are reached at once."""
    if (
        table["formation"]["kind"] == "circle"
        and "airframe" not in table["drones"][0]
        and chance.random() < SMALL_SHARE
    ):
        table["drones"] = table["drones"][:SMALL]
        table["graph"] = {"edges": [[i, i + 1] for i in range(SMALL - 1)]}
        table["control"]["rate_hz"] = SLOW
        table.setdefault("gateway", {})["rate_hz"] = SLOW
    kind = {"kind": "circle", "radius": 1.5, "rate": 0.2}
    table["formations"] = {"wide": kind}
    draw = chance.random()
    limits = table.setdefault("limits", {})
    if draw < 0.08:
        limits["start_tolerance"] = chance.choice((0.001, 0.004))
    elif draw < 0.16:
        limits["battery_takeoff"] = chance.choice((0.9, 1.0))
        table.setdefault("airframes", {}).setdefault("kinematics", {})["endurance"] = chance.uniform(20.0, 60.0)


def rare_faults(plan: Plan, without: tuple[int, ...], chance: Random) -> list[dict[str, Any]]:
    """Draw what else happens."""
    found = []
    for _ in range(chance.choice((1, 1, 2, 3))):
        kind = chance.choices(RARE_KINDS, (8, 1, 1, 1, 1, 1))[0]
        found.append(_DRAWN[kind](plan, without, chance) | {"kind": kind})
    if any(fault["kind"] == STATION_KILLED for fault in found):  # somebody lands them
        found.append(
            {"kind": ORDERS, "on": "takeoff", "at": 12.0, "station": "console", "orders": [(0.0, "land", "", ())]}
        )
    return found


def _orders(plan: Plan, without: tuple[int, ...], chance: Random) -> dict[str, Any]:
    on = chance.choice(("", "takeoff", "takeoff", "start", "start", "start", "land"))
    near = chance.random() < 0.5
    at = chance.uniform(0.2, 3.0) if not on else chance.uniform(0.0, 0.4) if near else chance.uniform(0.0, 9.0)
    station = chance.choice(("operator", "console", "console"))
    orders = []
    for place in range(chance.choice((1, 1, 2, 3))):
        verb = chance.choice(CONDUCTED if station == "operator" else ASKED)
        formation = chance.choice(("", "wide", "wide", "hasty")) if verb in ("start", "formation") else ""
        left_out = without or plan.swarm.flying[-1:] if verb == "start" and chance.random() < 0.2 else ()
        wait = chance.choice((0.1, 1.0, 6.0)) * chance.random() if place else 0.0
        orders.append((round(wait, 3), verb, formation, left_out))
    return {"on": on, "at": round(at, 3), "station": station, "orders": orders}


def _early(plan: Plan, _: tuple[int, ...], chance: Random) -> dict[str, Any]:
    driving = (identity for identity, row in plan.rows.items() if row.driver)
    processes = [identity for identity in plan.identities if identity not in {*plan.witnesses, *driving}]
    lasts = chance.choice((0.0, 1.0, 6.0, LONG))  # 0: for ever
    return {"at": round(chance.uniform(0.0, 2.0), 3), "process": chance.choice(processes), "duration": lasts}


def _hand(plan: Plan, _: tuple[int, ...], chance: Random) -> dict[str, Any]:
    return {"at": round(chance.uniform(0.0, 2.0), 3), "drone": chance.choice(plan.swarm.flying), "duration": 4.0}


def _killed(_: Plan, __: tuple[int, ...], chance: Random) -> dict[str, Any]:
    return {"at": round(chance.uniform(0.0, 8.0), 3)}


def _swap(plan: Plan, _: tuple[int, ...], chance: Random) -> dict[str, Any]:
    lasts = chance.choice((0.3, 3.0, 9.0))
    drones = chance.sample(plan.swarm.flying, 2)
    return {"at": round(chance.uniform(0.0, 8.0), 3), "drones": drones, "duration": lasts}


def _visitor(_: Plan, __: tuple[int, ...], chance: Random) -> dict[str, Any]:
    start, aside = (-4.0, chance.uniform(-1.5, 1.5), 1.0), chance.uniform(-0.2, 0.2)
    return {
        "at": round(chance.uniform(0.0, 6.0), 3),
        "start": list(start),
        "velocity": [1.0, aside, 0.0],
        "duration": 9.0,
    }


_DRAWN = {ORDERS: _orders, EARLY: _early, HAND: _hand, STATION_KILLED: _killed, "swap": _swap, "visitor": _visitor}
