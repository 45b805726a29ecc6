"""The swarm as markers for RViz: drones, places, estimates, edges, errors, obstacles, fence."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise

from flockwire_core.domain.vector import Vector, add
from flockwire_core.pilot.off_place import shown_phase
from flockwire_core.ros.messages import Colour, Marker, Shape, marker_array
from flockwire_core.swarm.model import uav
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.status import Status

from flockwire_operator.places import Places

WHITE: Colour = (1.0, 1.0, 1.0, 0.9)
ORANGE: Colour = (1.0, 0.6, 0.1, 1.0)
BLUE: Colour = (0.2, 0.5, 1.0, 1.0)
GREY: Colour = (0.6, 0.6, 0.6, 0.5)
GREEN: Colour = (0.2, 0.8, 0.3, 0.5)
RED: Colour = (0.9, 0.1, 0.1, 0.8)
PURPLE: Colour = (0.7, 0.3, 0.9, 0.7)


class Picture:
    """What is known of the swarm of `plan`, as markers; `statuses` has the newest of each process.

    Attributes:
        positions: of the drones, m, world frame.
        estimates: where each drone estimates the leader, m, world frame.

    """

    def __init__(self, plan: Plan, statuses: Mapping[str, Status]) -> None:
        self._plan, self._statuses, self._known = plan, statuses, Places(plan.swarm)
        self._pilots = {uav(i): pilot for i, pilot in plan.pilot.items()}
        self.positions: dict[str, Vector] = {}
        self.estimates: dict[str, Vector] = {}
        self._constant = (*self._fence(), *self._obstacles())

    def markers(self, now: int) -> bytes:
        """Return a MarkerArray of all that is known at `now` (Unix ns)."""
        lifetime = 0.5  # s for which a marker is drawn unless it comes again
        found = (*self._constant, *self._drones(), *self._edges(), *self._at_places(now))
        return marker_array(now, self._plan.swarm.frame, found, lifetime)

    def _drones(self) -> list[Marker]:
        size = 0.18  # m, of a drone
        found = []
        for number, (name, position) in enumerate(self.positions.items()):
            colour = ORANGE if name in map(uav, self._plan.swarm.leaders) else BLUE
            found.append(Marker("drones", number, Shape.SPHERE, colour, (size, size, size), position))
            text = "\n".join(filter(None, (name, self._told(name))))
            above = add(position, (0.0, 0.0, 1.5 * size))
            found.append(Marker("names", number, Shape.TEXT, WHITE, (0.0, 0.0, size), above, text=text))
        for number, (_, position) in enumerate(self.estimates.items()):
            found.append(Marker("estimates", number, Shape.SPHERE, PURPLE, (0.06, 0.06, 0.06), position))
        return found

    def _told(self, name: str) -> str:
        status = self._statuses.get(self._pilots[name])
        if status is None:
            return ""
        error = status.report.formation_error
        return shown_phase(status.report) + (f" {error:.2f} m" if error >= 0.0 else "")

    def _edges(self) -> list[Marker]:
        """Return an arrow for each edge of the graph, from the drone that sends to the one that receives."""
        found = []
        for number, (source, target, _) in enumerate(self._plan.swarm.graph.edges):
            ends = self.positions.get(uav(source)), self.positions.get(uav(target))
            if ends[0] is not None and ends[1] is not None:
                points = (ends[0], ends[1])
                found.append(Marker("edges", number, Shape.ARROW, GREY, (0.02, 0.06, 0.1), points=points))
        return found

    def _at_places(self, now: int) -> list[Marker]:
        """Return the place of each follower that flies a formation, and the error from the drone to it."""
        found, swarm = [], self._plan.swarm
        leader = self.positions.get(uav(swarm.sole_leader)) if swarm.sole_leader is not None else None
        for number, drone in enumerate(swarm.followers):
            status = self._statuses.get(self._plan.pilot[drone])
            if status is None or status.report.phase != Phase.FORMATION:
                continue
            place = self._known.place(drone, status.report, leader, now)
            if place is None:
                continue
            found.append(Marker("places", number, Shape.SPHERE, GREEN, (0.1, 0.1, 0.1), place))
            if uav(drone) in self.positions:
                error = (self.positions[uav(drone)], place)
                found.append(Marker("errors", number, Shape.LINE_LIST, RED, (0.02, 0.0, 0.0), points=error))
        return found

    def _fence(self) -> tuple[Marker, ...]:
        fence = self._plan.swarm.limits.fence
        (left, front, floor), (right, back, ceiling) = fence.low, fence.high
        corners = fence.polygon or ((left, front), (right, front), (right, back), (left, back))
        points: list[Vector] = []
        for (x1, y1), (x2, y2) in pairwise((*corners, corners[0])):
            for z in (floor, ceiling):
                points += ((x1, y1, z), (x2, y2, z))
            points += ((x1, y1, floor), (x1, y1, ceiling))
        return (Marker("fence", 0, Shape.LINE_LIST, GREY, (0.02, 0.0, 0.0), points=tuple(points)),)

    def _obstacles(self) -> tuple[Marker, ...]:
        tall = 3.0  # m, of an obstacle without an end
        found = []
        for number, obstacle in enumerate(self._plan.swarm.obstacles):
            height, width = obstacle.height or tall, max(2.0 * obstacle.radius, 0.05)
            middle = add(obstacle.center, (0.0, 0.0, 0.5 * height))
            found.append(Marker("obstacles", number, Shape.CYLINDER, RED, (width, width, height), middle))
        return tuple(found)
