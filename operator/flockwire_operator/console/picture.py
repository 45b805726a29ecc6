"""The data of the page after the constant one: all states, ten times a second."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import Vector
from flockwire_core.ground.fleet import STALE
from flockwire_core.pilot.off_place import shown_phase
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.status import Status

from flockwire_operator.places import Places


def snapshot(plan: Plan, places: Places, statuses: Mapping[str, Status], now: int) -> dict[str, Any]:
    """Return all states at `now` (Unix ns); `now` in it is in s, `mission` the flight's time if it has one."""
    sole = plan.swarm.sole_leader
    leading = statuses.get(plan.pilot[sole]) if sole is not None else None
    leader = None if leading is None else leading.report.position
    drones = {}
    for number, pilot in plan.pilot.items():
        if (status := statuses.get(pilot)) is not None:
            place = places.place(number, status.report, leader, now)
            drones[number] = {**_told(status, now), "place": _rounded(place)}
    others = {
        identity: _told(statuses[identity], now)
        for identity in plan.started
        if identity in statuses and not plan.rows[identity].pilot
    }
    return {"now": now / SECOND, "mission": _mission_time(statuses, now), "drones": drones, "others": others}


def _mission_time(statuses: Mapping[str, Status], now: int) -> float | None:
    """Return the time in s since the newest start that a process obeys, None before one."""
    missions = [status.report.mission for status in statuses.values()]
    starts = [mission.start for mission in missions if mission is not None and mission.in_formation]
    return round((now - max(starts)) / SECOND, 2) if starts else None


def _told(status: Status, now: int) -> dict[str, Any]:
    report = status.report
    return {
        "phase": shown_phase(report) if now - status.stamp < STALE else "silent",
        "detail": report.line,
        "position": _rounded(report.position),
        "battery": report.battery,
        "error": report.formation_error,
        "formation": report.mission.formation if report.mission is not None and report.mission.in_formation else None,
        "sheet": {"share of a core": f"{100 * status.cpu:.0f} %", "links": str(len(status.links))},
    }


def _rounded(place: Vector | None) -> list[float] | None:
    return None if place is None else [round(x, 3) for x in place]
