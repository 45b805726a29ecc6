"""The places of followers in the formation, by what they report."""

from __future__ import annotations

from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import Vector, add
from flockwire_core.pilot.orders import flown_place, is_known
from flockwire_core.swarm.model import Swarm
from flockwire_core.wire.status import Report


class Places:
    """The places of the followers of `swarm`."""

    def __init__(self, swarm: Swarm) -> None:
        self._swarm = swarm
        self._formations = {name: swarm.build_formation(name) for name in swarm.formation_names}

    def place(self, number: int, report: Report, leader: Vector | None, now: int) -> Vector | None:
        """Return x_0 + h_i of a follower at `now` (Unix ns), m, by its report and where the leader is.

        It is None for other drones, without a leader, and for one that was ordered no formation or holds no place.
        """
        swarm, mission = self._swarm, report.mission
        if leader is None or mission is None or number not in swarm.followers:
            return None
        if not mission.in_formation or not is_known(self._formations, mission):
            return None
        held = report.place if mission.formation in swarm.auctioned else None
        if mission.formation in swarm.auctioned and (held is None or held >= len(swarm.followers)):
            return None
        formation, index = flown_place(self._formations, mission, swarm.followers.index(number), held)
        return add(leader, formation.offset(index, (now - mission.start) / SECOND))
