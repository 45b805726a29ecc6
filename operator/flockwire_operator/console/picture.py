"""The data of the page after the constant one: all states, ten times a second."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import add
from flockwire_core.ground.fleet import STALE
from flockwire_core.pilot.off_place import shown_phase
from flockwire_core.pilot.orders import reported_place
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.status import Report, Status


class Scene:
    """Combines statuses for the page."""

    def __init__(self, plan: Plan) -> None:
        self._plan = plan
        self._formations = {name: plan.swarm.build_formation(name) for name in plan.swarm.formation_names}

    def snapshot(self, statuses: Mapping[str, Status], now: int) -> dict[str, Any]:
        """Return all states at `now` (Unix ns); `now` in it is in s, `mission` the flight's time if it has one."""
        sole = self._plan.swarm.sole_leader
        leader = statuses.get(self._plan.pilot[sole]) if sole is not None else None
        drones = {}
        for number, pilot in self._plan.pilot.items():
            status = statuses.get(pilot)
            if status is not None:
                place = self._place(number, status.report, leader, now)
                drones[number] = {**_told(status, now), "place": place}
        others = {
            identity: _told(statuses[identity], now)
            for identity in self._plan.started
            if identity in statuses and not self._plan.rows[identity].pilot
        }
        return {"now": now / SECOND, "mission": _mission_time(statuses, now), "drones": drones, "others": others}

    def _place(self, number: int, report: Report, leader: Status | None, now: int) -> list[float] | None:
        """Return the place of a follower in the formation that it was ordered to fly, None if it has none."""
        if (
            number in self._plan.swarm.leaders
            or leader is None
            or leader.report.position is None
            or report.mission is None
        ):
            return None
        found = reported_place(self._plan.swarm, self._formations, report, number)
        if found is None:
            return None
        formation, index = found
        offset = formation.offset(index, (now - report.mission.start) / SECOND)
        return [round(place, 3) for place in add(leader.report.position, offset)]


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
        "position": [round(x, 3) for x in report.position] if report.position is not None else None,
        "battery": report.battery,
        "error": report.formation_error,
        "formation": report.mission.formation if report.mission is not None and report.mission.in_formation else None,
        "sheet": {"share of a core": f"{100 * status.cpu:.0f} %", "links": str(len(status.links))},
    }
