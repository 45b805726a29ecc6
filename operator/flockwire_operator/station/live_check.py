"""`flockwire check --live`: whether a running swarm on the ground may take off.

It judges the reports of the processes for a few seconds, without orders or motion.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from math import dist
from pathlib import Path
from typing import NamedTuple

from flockwire_core.domain.airframe import Telemetry
from flockwire_core.domain.order import Mission
from flockwire_core.domain.vector import Vector
from flockwire_core.ground.fleet import IN_THE_AIR, STALE
from flockwire_core.ground.preflight import has_flown
from flockwire_core.runtime.session import Session
from flockwire_core.swarm.model import uav
from flockwire_core.swarm.wording import beside
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.processes import OPERATOR
from flockwire_core.wire.status import SERIAL, Reason, Status

from flockwire_operator.station.operator import Operator

WAITING = "start or mend what it waits for"


class Finding(NamedTuple):
    """One line of the table; `remedy` is empty if there is no problem."""

    subject: str
    item: str
    value: str
    remedy: str = ""


class Seen(NamedTuple):
    """The operator's data: the newest status and telemetry, and the positions of each drone's pose, m."""

    statuses: Mapping[str, Status]
    telemetry: Mapping[int, Telemetry]
    positions: Mapping[int, list[Vector]]
    now: int  # Unix ns


async def look(plan: Plan, keys: Path) -> Seen:
    """Observe for 4 s; raises CredentialsError, RouterAbsentError."""
    with Session(plan, OPERATOR.kind, keys) as session:
        operator = Operator(session)
        positions: dict[int, list[Vector]] = {drone: [] for drone in plan.pilots}

        def note() -> bool:
            """Note the positions that drones report."""
            for drone, pilot in plan.pilots.items():
                status = operator.statuses.get(pilot)
                if status is not None and status.report.position is not None:
                    positions[drone].append(status.report.position)
            return False

        await operator.watch(4.0, note)
        return Seen(operator.statuses, operator.telemetry, positions, operator.poll())


def findings(plan: Plan, seen: Seen) -> Iterator[Finding]:
    """Yield the lines of each process and each drone."""
    for identity in plan.started:
        yield _process(plan, identity, seen)
    for drone, pilot in plan.pilots.items():
        status = _fresh(seen, pilot)
        if status is not None:
            yield from _pilot(plan, drone, status, seen)
        yield from _airframe(plan, drone, seen)
    yield from _serials(plan, seen)


def _fresh(seen: Seen, identity: str) -> Status | None:
    status = seen.statuses.get(identity)
    return status if status is not None and seen.now - status.stamp < STALE else None


def _process(plan: Plan, identity: str, seen: Seen) -> Finding:
    row, member, status = plan.rows[identity], plan.members[identity], _fresh(seen, identity)
    if status is None:
        line = f"flockwire {row.kind} SWARM{f' {member.drone}' if plan.is_named_by_id(identity) else ''}"
        return Finding(identity, "process", "silent", f"start it: {line}; if it runs, its log gives the reason")
    bound, most = status.clock_bound, plan.swarm.limits.clock_offset_bound
    if bound < 0.0 or bound > most:
        known = f"off by up to {bound:.3f} s" if bound >= 0.0 else "not known yet"
        return Finding(
            identity, "clock", known, f"wait; otherwise the network's round trip takes more than {2.0 * most:g} s"
        )
    if status.report.phase == Phase.WAITING:
        return Finding(identity, "process", status.report.detail, WAITING)
    return Finding(identity, "process, clock", f"{status.report.phase}, known to {1e3 * bound:.1f} ms")


def _pilot(plan: Plan, drone: int, status: Status, seen: Seen) -> Iterator[Finding]:
    still = 0.02  # m, largest apparent motion of a body on the ground
    name, limits, report = uav(drone), plan.swarm.limits, status.report
    fresh = 0.0 <= report.pose_age <= limits.staleness.pose_zero
    lost = f"is the body {plan.swarm.body(drone)!r} in the cameras' view, with this name ([[drones]] body)?"
    if 0.0 <= report.pose_age <= limits.staleness.pose_land:
        lost = "poses come late: this machine, or the network, is too slow or too busy"
    yield Finding(
        name, "pose", f"{report.pose_age:.3f} s old" if report.pose_age >= 0.0 else "none", "" if fresh else lost
    )
    places = seen.positions[drone]
    if places:
        spread = max(dist(place, places[0]) for place in places)
        moves = "put it down; otherwise the tracker confuses it with another body, or needs calibration"
        yield Finding(name, "still", f"within {1e3 * spread:.1f} mm", "" if spread <= still else moves)
        yield _start(plan, drone, places[-1], report.mission)
    ready = report.phase == Phase.READY
    waits = report.line or f"it is {report.phase}"
    yield Finding(
        name, "neighbours", "heard" if ready else waits, "" if ready else "see the lines of the processes it waits for"
    )


def _start(plan: Plan, drone: int, place: Vector, mission: Mission | None) -> Finding:
    off, most = dist(place, plan.swarm.drone(drone).start), plan.swarm.limits.start_tolerance
    flown = has_flown(mission) or drone not in plan.swarm.flying
    wrong = f"put it there, or correct [[drones]] start or body; more than limits.start_tolerance = {most:g} m"
    return Finding(uav(drone), "start", f"{beside(off, most)} m beside it", "" if flown or off <= most else wrong)


def _airframe(plan: Plan, drone: int, seen: Seen) -> Iterator[Finding]:
    name, limits, telemetry = uav(drone), plan.swarm.limits, seen.telemetry.get(drone)
    for status in _drivers(plan, drone, seen):
        yield from _driver(name, plan.swarm.row(drone).live_checks, status)
    if telemetry is None or seen.now - telemetry.stamp > STALE:
        yield Finding(name, "telemetry", "none", "the line of its driver gives the reason")
        return
    low = telemetry.battery < limits.battery_takeoff
    yield Finding(
        name, "battery", f"{telemetry.battery:.0%}", f"charge it to {limits.battery_takeoff:.0%}" if low else ""
    )
    airborne = telemetry.state in IN_THE_AIR
    yield Finding(name, "on the ground", telemetry.state.name.lower(), "land it first" if airborne else "")


def _driver(name: str, checked: Iterable[str], status: Status) -> Iterator[Finding]:
    """Yield what a driver says of the codes that are `checked`, and its other problems."""
    known = {code: Reason(code, "nothing wrong") for code in checked}
    for reason in sorted(status.report.reasons, key=lambda one: bool(one.remedy)):
        if reason.remedy or reason.code in known:
            known[reason.code] = reason
    yield from (Finding(name, reason.code, reason.text, reason.remedy) for reason in known.values())


def _drivers(plan: Plan, drone: int, seen: Seen) -> Iterable[Status]:
    """Return the statuses of a drone's drivers; a silent driver has its own line."""
    drivers = [i for i, row in plan.rows.items() if row.driver and plan.members[i].drone == drone]
    return filter(None, (_fresh(seen, driver) for driver in drivers))


def _serials(plan: Plan, seen: Seen) -> Iterator[Finding]:
    """Yield drones that are reached by two addresses."""
    owners: dict[str, int] = {}
    for drone in plan.swarm.driven:
        for status in _drivers(plan, drone, seen):
            for code, serial, _ in status.report.reasons:
                if code == SERIAL and (other := owners.setdefault(serial, drone)) != drone:
                    remedy = f"give each drone its own {plan.swarm.row(drone).kind}.address"
                    yield Finding(uav(drone), "address", f"the drone {serial} is {uav(other)} already", remedy)


def table(found: Iterable[Finding]) -> Iterator[str]:
    """Yield the lines of the table."""
    for subject, item, value, remedy in found:
        yield f"  {'FAIL' if remedy else 'ok  '} {subject:<11} {item:<20} {value}{f' -> {remedy}' if remedy else ''}"
