"""The place of a follower in formations whose places are shared out by an auction."""

from __future__ import annotations

from collections.abc import Mapping

from flockwire_core.domain.motion import LeaderMotion
from flockwire_core.domain.order import Mission
from flockwire_core.domain.vector import ZERO, Vector
from flockwire_core.parameters import auction_parameters, pilot_parameters
from flockwire_core.pilot.pilot import Pilot
from flockwire_core.pilot.place import Place as WaitingPlace
from flockwire_core.swarm.model import Swarm, uav
from flockwire_core.wire.codec import Message
from flockwire_core.wire.keys import Key
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.status import Report

from flockwire_agent.ordered_place import OrderedPlace
from flockwire_agent.place_auction import PlaceAuction

NOBODYS: Mapping[int, int] = {}  # nobody knows the others' places by an auction


class AuctionedPlace(OrderedPlace):
    """The place that follower `number` holds by the auction; without one it waits where it is."""

    def __init__(self, swarm: Swarm, number: int, born: int) -> None:
        super().__init__(swarm, number)
        self._auction = PlaceAuction(auction_parameters(swarm), number, swarm.frame, born)
        self._waiting, self._key = WaitingPlace(pilot_parameters(swarm, number)), Key("bids", uav(number))
        self._ordered_ranks = self._known
        bidders = [j for j in swarm.topology.neighbours(number) if j not in swarm.leaders]
        self.handlers = {Key("bids", uav(j)): self._auction.take for j in bidders}

    def order(self, mission: Mission, now: int) -> None:
        """Begin an auction, if the order is into such a formation."""
        self._auction.order(mission, now)
        self._known = NOBODYS if self._auction.ordered else self._ordered_ranks

    def update(self, phase: Phase, mission: Mission | None) -> None:
        """Set the place that it holds; in a formation with an auction, none before that."""
        auction = self._auction
        if auction.place != self._held:
            self._held, self._flown = auction.place, None
        super().update(phase, mission)
        if auction.ordered and self._held is None:
            self.place = None
        if phase is not Phase.FORMATION or self.place is not None:
            self._waiting.forget()

    def command(self, wanted: Vector, phase: Phase, pilot: Pilot) -> Vector:
        """Return the velocity, m/s, that keeps the drone where it began to wait for a place."""
        if phase is not Phase.FORMATION or self.place is not None:
            return wanted
        if pilot.motion is None:
            return ZERO
        return self._waiting.velocity(Phase.HOLD, pilot.motion.position, pilot.bodies)

    def messages(self, phase: Phase, pilot: Pilot, leader: LeaderMotion | None, now: int) -> list[tuple[Key, Message]]:
        """Return its bids, if any are due."""
        bids = self._auction.step(phase, pilot.motion, leader, now)
        return [] if bids is None else [(self._key, bids)]

    def reported(self, report: Report) -> Report:
        """Return `report` with the place that it holds."""
        return self._auction.reported(report)
