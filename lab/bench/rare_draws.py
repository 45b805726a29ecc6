"""What "rare faults" adds to a drawn flight: rare branches of the network, orders of two stations, rare faults.

The draws look for what no usual one reaches: an order at the moment of another one, a process that restarts as its
drone takes off, a start without a drone, a body with another's name, a person, a drone in a hand.
"""

from __future__ import annotations

from collections.abc import Callable
from random import Random
from typing import Any

from flockwire_core.swarm.tables import Limits
from flockwire_core.wire.plan import Plan
from flockwire_lab.faults.targets import targets

Faults = list[dict[str, Any]]
Without = tuple[int, ...]  # drones that stay on the ground

ORDERS = "orders"  # of one station, `at` s after an order was published (`on`; empty: the flight's beginning)
EARLY = "early"  # a process that is killed, or stands still, `at` s after the flight's beginning
HAND = "hand"  # a Tello in a hand before the flight
STATION_KILLED = "station killed"  # and nobody is told
AT_TAKE_OFF = "at take-off"  # a fault just as the drones take off, and perhaps an order
PREPARING = "preparing"  # orders before the order to take off, which waits for a process
CROSSING = "crossing"  # upward orders of both stations at once
DEAF = "deaf"  # a process is frozen as a station gives an order
UPLINK = "uplink"  # a Tello receives nothing, though its state arrives
OTHER_FLIES = "other flies"  # the second station conducts a long flight, and nobody else; not by the paper's law
SECOND_FLIGHT = "second flight"  # the station conducts a new flight of drones that fly
ORPHAN = "orphan"  # a pilot that restarts in flight when nobody knows its order any more
CLOCK = "station's clock"  # the second station's is ahead
HASTY = "hasty"  # to the other formation, too fast
APART = "false_pose"  # the tracker moves one body away, where pilots watch for it (limits.body_drift)
FALSE = ("swap", "visitor", APART)  # bodies, which the simulated world injects
_SHARES = {
    ORDERS: 4.0, EARLY: 0.7, HAND: 3.0, STATION_KILLED: 0.3, AT_TAKE_OFF: 4.0, PREPARING: 4.0, CROSSING: 7.0, DEAF: 3.0,
    SECOND_FLIGHT: 2.0, UPLINK: 4.0, OTHER_FLIES: 5.0, ORPHAN: 0.9, CLOCK: 1.0, "swap": 2.0, "visitor": 1.0,
}  # fmt: skip
RARE_KINDS = (ORDERS, EARLY, HAND, UPLINK, STATION_KILLED, OTHER_FLIES, CLOCK, *FALSE)
CONDUCTED = ("hold", "hold", "resume", "resume", "land", "stop", "conduct")  # by the station that conducts the flight
ASKED = ("start", "start", "start", "formation", "formation", "hold", "land", "stop")
ORDERED = (*((verb, "console") for verb in ASKED), *((verb, "operator") for verb in CONDUCTED))
ANSWERED = 0.2  # of the flights
LONG = 36.0  # s, longer than the director waits
LANDED = 25.0  # s after the take-off, when the second station lands those whose own was killed


def rare_faults(plan: Plan, without: Without, chance: Random) -> Faults:
    """Draw what else happens."""
    found: Faults = []
    driven = len(_drivers(plan)) > 1  # each by its own driver
    barred = (*(() if driven else (HAND, UPLINK)), *((OTHER_FLIES,) if plan.swarm.control.law == "paper" else ()))
    watched = plan.swarm.limits.body_drift < Limits().body_drift
    barred += ("swap",) if watched else ()  # a tracker that lies in two ways cannot be answered
    shares = {kind: share for kind, share in _SHARES.items() if kind not in barred}
    for kind in chance.choices(tuple(shares), tuple(shares.values()), k=chance.choice((1, 1, 2, 3))):
        found += [{"kind": kind} | fault for fault in _DRAWN[kind](plan, without, chance)]
    if watched:
        at, velocity = chance.uniform(2.0, 6.0), [0.0, 0.0, 0.0]
        velocity[chance.randrange(2)] = chance.choice((-0.6, 0.6))
        moved = {"drone": chance.choice(plan.swarm.flying), "velocity": velocity, "duration": 6.0}
        found.append({"kind": APART, "at": round(at, 3)} | moved)
    if any(fault["kind"] in (STATION_KILLED, OTHER_FLIES) for fault in found):
        found.append(_asked(LANDED, "land"))
    return found


def answered(plan: Plan, chance: Random) -> Faults:
    """Draw, for some flights, a start that the landed flight's frozen station sees late, or two holds before any."""
    if chance.random() >= ANSWERED:
        return []
    if chance.random() < 0.5:
        at = chance.uniform(2.0, 8.0)
        frozen = {"kind": "station frozen", "at": at + 0.5, "duration": 12.0}
        return [frozen, _asked(at, "land", "operator"), _asked(at + chance.uniform(5.0, 8.0), "start")]
    at, process = chance.uniform(0.1, 3.0), chance.choice(list(plan.pilots.values()))
    waits = {"kind": EARLY, "at": 0.0, "process": process, "duration": 4.0}
    return [waits, *(_asked(at + chance.uniform(0.0, 0.1), "hold", on="") for _ in range(2))]


def _asked(at: float, verb: str, station: str = "console", on: str = "takeoff") -> dict[str, Any]:
    orders = [(0.0, verb, "wide" if verb in ("start", "formation") else "", ())]
    return {"kind": ORDERS, "on": on, "at": round(at, 3), "station": station, "orders": orders}


def _orders(plan: Plan, without: Without, chance: Random) -> Faults:
    on = chance.choice(("", "takeoff", "takeoff", "start", "start", "land"))
    near = chance.random() < 0.5
    at = chance.uniform(0.2, 3.0) if not on else chance.uniform(0.0, 0.4) if near else chance.uniform(0.0, 9.0)
    station = chance.choice(("operator", "console", "console"))
    orders = []
    for place in range(chance.choice((1, 1, 2, 3))):
        verb = chance.choice(CONDUCTED if station == "operator" else ASKED)
        formation = chance.choice(("", "wide", "wide", HASTY)) if verb in ("start", "formation") else ""
        left_out = without or plan.swarm.flying[-1:] if verb == "start" and chance.random() < 0.2 else ()
        wait = chance.choice((0.1, 1.0, 6.0)) * chance.random() if place else 0.0
        orders.append((round(wait, 3), verb, formation, left_out))
    return [{"on": on, "at": round(at, 3), "station": station, "orders": orders}]


def _early(plan: Plan, _: Without, chance: Random) -> Faults:
    processes = [identity for identity in targets(plan) if identity not in _drivers(plan)]
    lasts = chance.choice((0.0, 1.0, 6.0, LONG))  # 0: for ever
    return [{"at": _moment(chance, 1.0), "process": chance.choice(processes), "duration": lasts}]


def _hand(plan: Plan, _: Without, chance: Random) -> Faults:
    return [{"at": 0.25 + _moment(chance, 0.5), "drone": chance.choice(plan.swarm.flying), "duration": 6.0}]


def _killed(_: Plan, __: Without, chance: Random) -> Faults:
    return [{"at": _moment(chance, 8.0)}]


def _at_take_off(plan: Plan, _: Without, chance: Random) -> Faults:
    at = _moment(chance, chance.choice((0.05, 0.3, 2.0)))
    lost = {"kind": "tracker", "drone": chance.choice(plan.swarm.flying), "duration": chance.choice((1.0, 4.0))}
    restarted = {"kind": "restart", "process": chance.choice(list(plan.pilots.values()))}
    asked = [_asked(chance.uniform(0.0, 4.0), *chance.choice(ORDERED)) for _ in range(chance.choice((0, 1, 1)))]
    variant = chance.random()
    if variant < 0.3:  # before telemetry tells that they fly
        return [_asked(chance.uniform(0.0, 0.04), "land", chance.choice(("operator", "console")))]
    if variant < 0.55:  # one still climbs
        lost["duration"] = 0.8
        return [{"at": chance.uniform(0.2, 1.0)} | lost, _asked(chance.uniform(1.6, 2.6), "formation")]
    return [{"at": at} | chance.choice((lost, restarted)), *asked]


def _preparing(plan: Plan, without: Without, chance: Random) -> Faults:
    process, lasts = chance.choice(list(plan.pilots.values())), chance.choice((1.0, 4.0, 7.0))
    waits = {"kind": EARLY, "process": process, "duration": lasts}
    asked = [_asked(chance.uniform(0.1, 4.0), *chance.choice(ORDERED), on="") for _ in range(chance.choice((1, 1, 2)))]
    if without:  # the others fly without the one that waits
        waits |= {"process": plan.pilots[without[0] - 1], "duration": 7.0}
        asked[0]["orders"] = [(0.0, "start", "", (without[0] - 1, *without))]
    return [waits | {"at": _moment(chance, 0.3)}, *asked]


def _crossing(_: Plan, __: Without, chance: Random) -> Faults:
    at, on = chance.uniform(0.0, 7.0), chance.choice(("takeoff", "start", "start"))
    if chance.random() < 0.5:  # two pages of one station, or of two
        first = _asked(at, "formation", chance.choice(("operator", "console")), on)
        pages = [first, _asked(at, chance.choice(("start", "formation")), "console", on)]
        pages[1]["orders"] = [(0.0, pages[1]["orders"][0][1], "", ())]
        return chance.sample(pages, 2)
    held = [_asked(at - 1.0, "hold", chance.choice(("operator", "console")), on)] if at > 1.0 else []
    upward = chance.choice(("formation", "formation", "start"))
    mine = _asked(at + chance.uniform(0.0, 0.3), chance.choice(("resume", "resume", "hold")), "operator", on)
    return [*held, _asked(at + chance.uniform(0.0, 0.3), upward, "console", on), mine]


def _deaf(plan: Plan, _: Without, chance: Random) -> Faults:
    at, processes = chance.uniform(0.0, 8.0), [*plan.pilots.values(), *_drivers(plan)]
    frozen = {"kind": "freeze", "process": chance.choice(processes), "duration": chance.choice((0.8, 2.0, 6.0))}
    if len(_drivers(plan)) > 1 and chance.random() < 0.4:  # it lands without its driver
        own = [driver for driver in _drivers(plan) if driver != "kinematics"]  # with which the world stands still
        frozen |= {"process": chance.choice(own), "duration": LONG}
    return [{"at": round(at, 3)} | frozen, _asked(at + chance.uniform(0.0, 0.5), *chance.choice(ORDERED))]


def _second_flight(_: Plan, __: Without, chance: Random) -> Faults:
    at, on = chance.uniform(0.5, 7.0), chance.choice(("takeoff", "start", "start"))
    after = _asked(at + chance.choice((0.0, 0.0, 1.0)) * chance.random(), chance.choice(CONDUCTED), "operator", on)
    return [_asked(at, "conduct", "operator", on), after]


def _uplink(plan: Plan, _: Without, chance: Random) -> Faults:
    at = _moment(chance, 8.0)
    lost = {"at": at, "drone": chance.choice(plan.swarm.flying), "duration": chance.choice((1.0, 8.0))}
    return [lost, _asked(at + chance.uniform(0.0, 0.5), chance.choice(("stop", "stop", "land", "hold")))]


def _other_flies(plan: Plan, without: Without, chance: Random) -> Faults:
    started = _asked(chance.uniform(0.2, 1.0), "start", on="") | {"orders": [(0.0, "start", "", without)]}
    asked = [_asked(chance.uniform(0.0, 9.0), *chance.choice(ORDERED)) for _ in range(chance.choice((0, 1, 2)))]
    last, before = plan.pilots[plan.swarm.flying[-1]], plan.pilots[plan.swarm.flying[-2]]
    cut = {"at": _moment(chance, 3.0), "kind": "cut", "from": before, "to": last, "duration": 6.0}
    if chance.random() < 0.3:  # one lands by itself; the others are to fly on without it
        drone = plan.swarm.flying[-1]
        lost = {"at": 6.0 + _moment(chance, 2.0), "kind": "tracker", "drone": drone, "duration": 2.0}
        again = _asked(chance.uniform(11.0, 15.0), "start") | {"orders": [(0.0, "start", "", (*without, drone))]}
        return [{"at": 0.0}, started, lost, again]
    return [{"at": 0.0}, started, *asked, *([cut] if chance.random() < 0.7 else [])]


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
    lasts = chance.choice((0.3, 9.0, 9.0))
    return [{"at": _moment(chance, 8.0), "drones": chance.sample(plan.swarm.flying, 2), "duration": lasts}]


def _visitor(_: Plan, __: Without, chance: Random) -> Faults:
    start, velocity = [-4.0, chance.uniform(-1.5, 1.5), 1.0], [1.0, chance.uniform(-0.2, 0.2), 0.0]
    return [{"at": _moment(chance, 6.0), "start": start, "velocity": velocity, "duration": 9.0}]


def _drivers(plan: Plan) -> list[str]:
    return [identity for identity, row in plan.rows.items() if row.driver]


def _moment(chance: Random, latest: float) -> float:
    return round(chance.uniform(0.0, latest), 3)


_DRAWN: dict[str, Callable[[Plan, Without, Random], Faults]] = {
    ORDERS: _orders, EARLY: _early, HAND: _hand, STATION_KILLED: _killed, AT_TAKE_OFF: _at_take_off, ORPHAN: _orphan,
    PREPARING: _preparing, CROSSING: _crossing, DEAF: _deaf, SECOND_FLIGHT: _second_flight, CLOCK: _clock,
    UPLINK: _uplink, OTHER_FLIES: _other_flies, "swap": _swap, "visitor": _visitor,
}  # fmt: skip
