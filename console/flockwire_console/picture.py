"""The data of the page: once the swarm file's content, then all states ten times a second."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from flockwire.control.graph import LEADER
from flockwire.domain.order import Mission
from flockwire.domain.time import SECOND
from flockwire.ground.fleet import STALE
from flockwire.pilot.off_place import shown_phase
from flockwire.pilot.orders import flown_formation, is_known
from flockwire.wire.plan import Plan
from flockwire.wire.status import Status


def outline(plan: Plan) -> dict[str, Any]:
    """Return the constant data of a flight: fence, obstacles, graph, formations (m, world frame)."""
    swarm, fence = plan.swarm, plan.swarm.limits.fence
    (left, lower, _), (right, upper, _) = fence.low, fence.high
    corners = fence.polygon or ((left, lower), (right, lower), (right, upper), (left, upper))
    return {
        "name": swarm.name,
        "drones": [{"id": i, "name": pilot} for i, pilot in plan.pilot.items()],
        "processes": list(plan.started),
        "edges": [[edge[0], edge[1]] for edge in swarm.graph.edges],
        "fence": [list(corner) for corner in corners],
        "obstacles": [{"center": list(o.center[:2]), "radius": o.radius} for o in swarm.obstacles],
        "clearance": swarm.avoidance.obstacle_safety_distance,
        "formations": list(swarm.formations),
    }


class Scene:
    """Combines statuses for the page."""

    def __init__(self, plan: Plan) -> None:
        self._plan = plan
        self._formations = {name: plan.swarm.build_formation(name) for name in plan.swarm.formation_names}

    def snapshot(self, statuses: Mapping[str, Status], now: int) -> dict[str, Any]:
        """Return all states at `now` (Unix ns)."""
        leader = statuses.get(self._plan.pilot[LEADER])
        drones = {}
        for number, pilot in self._plan.pilot.items():
            status = statuses.get(pilot)
            if status is not None:
                place = self._place(number, status.report.mission, leader, now)
                drones[number] = {**_told(status, now), "place": place}
        others = {
            identity: _told(statuses[identity], now)
            for identity in self._plan.started
            if identity in statuses and not self._plan.rows[identity].pilot
        }
        return {"drones": drones, "others": others}

    def _place(self, number: int, mission: Mission | None, leader: Status | None, now: int) -> list[float] | None:
        """Return the place of a follower in the formation that it was ordered to fly, None if it has none."""
        if number == LEADER or leader is None or leader.report.position is None or mission is None:
            return None
        if not mission.in_formation or not is_known(self._formations, mission):
            return None
        formation, rank = flown_formation(self._formations, mission), self._plan.swarm.followers.index(number)
        x, y, _ = formation.offset(rank, (now - mission.start) / SECOND)
        return [round(leader.report.position[0] + x, 3), round(leader.report.position[1] + y, 3)]


def _told(status: Status, now: int) -> dict[str, Any]:
    report = status.report
    return {
        "phase": shown_phase(report) if now - status.stamp < STALE else "silent",
        "detail": report.line,
        "position": [round(x, 3) for x in report.position] if report.position is not None else None,
        "battery": report.battery,
        "error": report.formation_error,
        "formation": report.mission.formation if report.mission is not None and report.mission.in_formation else None,
        "cpu": status.cpu,
        "links": len(status.links),
    }
