"""The place of a follower in the formation that is ordered."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from flockwire_core.domain.motion import LeaderMotion
from flockwire_core.domain.order import Mission
from flockwire_core.domain.vector import Vector
from flockwire_core.law import Place
from flockwire_core.objects import load_object
from flockwire_core.pilot.orders import flown_place
from flockwire_core.pilot.pilot import Pilot
from flockwire_core.swarm.model import Swarm
from flockwire_core.wire.codec import Message
from flockwire_core.wire.keys import Key
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.status import Report

AUCTIONED = "flockwire_agent.place_auction:AuctionedPlace"  # loaded by name: few swarms have an auction


class OrderedPlace:
    """The place of follower `number` of `swarm`, by the order; `place` is that to fly in, None outside a formation."""

    def __init__(self, swarm: Swarm, number: int) -> None:
        self.place: Place | None = None
        self.formations = {name: swarm.build_formation(name) for name in swarm.formation_names}
        self.handlers: dict[Key, Callable[[Any], None]] = {}
        self._rank = swarm.followers.index(number)
        ranks = {j: rank for rank, j in enumerate(swarm.followers)}
        self._known: Mapping[int, int] = {j: ranks[j] for j in swarm.topology.neighbours(number) if j in ranks}
        self._held: int | None = None  # in place of the order's
        self._flown: Mission | None = None  # the order of the place

    def order(self, mission: Mission, now: int) -> None:
        """Receive the order in force, at `now` (Unix ns)."""

    def update(self, phase: Phase, mission: Mission | None) -> None:
        """Set the place, in the formation phase."""
        if phase is not Phase.FORMATION or mission is None:
            self.place = None
        elif self.place is None or mission is not self._flown:
            self._flown = mission
            formation, rank = flown_place(self.formations, mission, self._rank, self._held)
            self.place = Place(formation, rank, mission.start, self._known)

    def command(self, wanted: Vector, phase: Phase, pilot: Pilot) -> Vector:
        """Return the law's command, or what takes its place."""
        return wanted

    def messages(self, phase: Phase, pilot: Pilot, leader: LeaderMotion | None, now: int) -> list[tuple[Key, Message]]:
        """Return what to publish at `now` (Unix ns), by the estimate of the `leader`."""
        return []

    def reported(self, report: Report) -> Report:
        """Return `report` with what it adds."""
        return report


def site_of(swarm: Swarm, number: int, born: int) -> OrderedPlace:
    """Return the place of follower `number`, whose process began at `born` (Unix ns): by the order or an auction."""
    if swarm.auctioned:
        site: OrderedPlace = load_object(AUCTIONED)(swarm, number, born)
        return site
    return OrderedPlace(swarm, number)
