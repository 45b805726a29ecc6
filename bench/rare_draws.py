"""What `--rare` adds to a drawn flight: rare branches of the network, orders of two stations, rare faults.

The draws look for what no usual one reaches: an order at the moment of another one, a process that restarts as its
drone takes off, a start without a drone, a body with another's name, a person, a drone in a hand.
"""

from __future__ import annotations

from collections.abc import Callable
from random import Random
from typing import Any

from flockwire.wire.plan import Plan

Faults = list[dict[str, Any]]
Without = tuple[int, ...]  # drones that stay on the ground

ORDERS = "orders"  # of one station, `at` s after an order was published (`on`; empty: the flight's beginning)
EARLY = "early"  # a process that is killed, or stands still, `at` s after the flight's beginning
HAND = "hand"  # a Tello in a hand before the flight
STATION_KILLED = "station killed"  # and nobody is told
AT_TAKE_OFF = "at take-off"  # a fault just as the drones take off
ORPHAN = "orphan"  # a pilot that restarts in flight when nobody knows its order any more
CLOCK = "station's clock"  # the second station's is ahead
WORLD_KINDS = ("swap", "visitor")  # which the simulated world injects
_SHARES = {
    ORDERS: 8.0, EARLY: 1.5, HAND: 1.0, STATION_KILLED: 0.5, AT_TAKE_OFF: 2.0, ORPHAN: 0.7, CLOCK: 0.7, "swap": 1.0,
    "visitor": 1.0,
}  # fmt: skip
RARE_KINDS = tuple(_SHARES)
CONDUCTED = ("hold", "hold", "resume", "resume", "land", "stop", "conduct")  # by the station that conducts the flight
ASKED = ("start", "start", "formation", "formation", "hold", "land", "stop")
SMALL_SHARE = 0.8  # of the flights of airframes without a driver of their own
SMALL, SLOW = 3, 20  # drones, steps a second: a tenth of the time
LONG = 36.0  # s, longer than the director waits
LANDED = 25.0  # s after the take-off, when the second station lands those whose own was killed


def alter(table: dict[str, Any], chance: Random) -> None:
    """Change the swarm file: a small swarm, other formations, and limits that are reached at once."""
    limits = table.setdefault("limits", {})
    if (
        table["formation"]["kind"] == "circle"
        and "airframe" not in table["drones"][0]
        and chance.random() < SMALL_SHARE
    ):
        table["drones"] = table["drones"][:SMALL]
        table["graph"] = {"edges": [[i, i + 1] for i in range(SMALL - 1)]}
        table["control"]["rate_hz"] = SLOW
        table.setdefault("gateway", {})["rate_hz"] = SLOW
    table["formations"] = {"wide": {"kind": "circle", "radius": 1.5, "rate": 0.2}}
    match chance.choice(("", "", "", "", "", "", "start", "battery", "blind")):
        case "start":
            limits["start_tolerance"] = chance.choice((0.001, 0.004))
            table.setdefault("gateway", {})["noise"] = 0.002
        case "battery":
            limits["battery_takeoff"] = chance.choice((0.9, 1.0))
            table.setdefault("airframes", {}).setdefault("kinematics", {})["endurance"] = chance.uniform(20.0, 60.0)
        case "blind":
            limits["blind_speed"] = chance.uniform(0.1, 0.2)


def rare_faults(plan: Plan, without: Without, chance: Random) -> Faults:
    """Draw what else happens."""
    found: Faults = []
    for kind in chance.choices(RARE_KINDS, tuple(_SHARES.values()), k=chance.choice((1, 1, 2, 3))):
        found += [{"kind": kind} | fault for fault in _DRAWN[kind](plan, without, chance)]
    if any(fault["kind"] == STATION_KILLED for fault in found):
        found.append(_asked(LANDED, "land"))
    return found


def _asked(at: float, *verbs: str) -> dict[str, Any]:
    orders = [(0.0, verb, "wide" if verb in ("start", "formation") else "", ()) for verb in verbs]
    return {"kind": ORDERS, "on": "takeoff", "at": at, "station": "console", "orders": orders}


def _orders(plan: Plan, without: Without, chance: Random) -> Faults:
    on = chance.choice(("", "takeoff", "takeoff", "start", "start", "land"))
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
    return [{"on": on, "at": round(at, 3), "station": station, "orders": orders}]


def _early(plan: Plan, _: Without, chance: Random) -> Faults:
    driving = (identity for identity, row in plan.rows.items() if row.driver)
    processes = [identity for identity in plan.identities if identity not in {*plan.witnesses, *driving}]
    lasts = chance.choice((0.0, 1.0, 6.0, LONG))  # 0: for ever
    return [{"at": _moment(chance, 1.0), "process": chance.choice(processes), "duration": lasts}]


def _hand(plan: Plan, _: Without, chance: Random) -> Faults:
    return [{"at": _moment(chance, 0.5), "drone": chance.choice(plan.swarm.flying), "duration": 6.0}]


def _killed(_: Plan, __: Without, chance: Random) -> Faults:
    return [{"at": _moment(chance, 8.0)}]


def _at_take_off(plan: Plan, _: Without, chance: Random) -> Faults:
    at = _moment(chance, chance.choice((0.05, 0.3, 2.0)))
    lost = {"kind": "tracker", "drone": chance.choice(plan.swarm.flying), "duration": chance.choice((1.0, 4.0))}
    restarted = {"kind": "restart", "process": chance.choice(list(plan.pilots.values()))}
    return [{"at": at} | chance.choice((lost, restarted))]


def _orphan(plan: Plan, _: Without, chance: Random) -> Faults:
    at = _moment(chance, 8.0)
    gateways = [identity for identity, row in plan.rows.items() if row.kind == "gateway"]
    pilot = {"at": at + 0.3, "kind": "restart", "process": chance.choice(list(plan.pilots.values()))}
    again = [{"at": at + 0.2, "kind": "restart", "process": identity} for identity in gateways]
    return [{"at": at, "kind": STATION_KILLED}, *again, pilot]


def _clock(_: Plan, __: Without, chance: Random) -> Faults:
    at = _moment(chance, 6.0)
    return [{"at": at, "step": chance.uniform(1.1, 1.5)}, _asked(at, chance.choice(ASKED))]


def _swap(plan: Plan, _: Without, chance: Random) -> Faults:
    lasts = chance.choice((0.3, 3.0, 9.0))
    return [{"at": _moment(chance, 8.0), "drones": chance.sample(plan.swarm.flying, 2), "duration": lasts}]


def _visitor(_: Plan, __: Without, chance: Random) -> Faults:
    start, velocity = [-4.0, chance.uniform(-1.5, 1.5), 1.0], [1.0, chance.uniform(-0.2, 0.2), 0.0]
    return [{"at": _moment(chance, 6.0), "start": start, "velocity": velocity, "duration": 9.0}]


def _moment(chance: Random, latest: float) -> float:
    return round(chance.uniform(0.0, latest), 3)


_DRAWN: dict[str, Callable[[Plan, Without, Random], Faults]] = {
    ORDERS: _orders, EARLY: _early, HAND: _hand, STATION_KILLED: _killed, AT_TAKE_OFF: _at_take_off, ORPHAN: _orphan,
    CLOCK: _clock, "swap": _swap, "visitor": _visitor,
}  # fmt: skip
