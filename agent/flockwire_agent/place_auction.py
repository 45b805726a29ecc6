"""A follower's part in the auction for the places of a formation (control/auction.py), order by order.

Its bids are messages of the law: their type is declared, and they travel along the edges on the key `law`, which a law
that relays the leader does not need for itself.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import dist, inf
from typing import Any

from flockwire_core.control.auction import LEAST, NOBODY, Auction, Bid, bids_of, highest_price
from flockwire_core.control.formation import Formation
from flockwire_core.domain.motion import LeaderMotion, Motion
from flockwire_core.domain.order import Mission
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.domain.vector import ZERO, Vector, subtract
from flockwire_core.law import Pace
from flockwire_core.parameters import pilot_parameters
from flockwire_core.pilot.pilot import Pilot
from flockwire_core.pilot.senses import HEARTBEAT, LawSender, Speaker
from flockwire_core.pilot.wanted import Place as WaitingPlace
from flockwire_core.swarm.model import Swarm, uav
from flockwire_core.wire.codec import Message
from flockwire_core.wire.keys import Key
from flockwire_core.wire.law_form import LawForm
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.status import NO_PLACE_YET, Report

from flockwire_agent.core import OrderedPlace

BIDDING = frozenset({Phase.TAKEOFF, Phase.HOLD, Phase.FORMATION})  # who lands, or stands, keeps what it holds
REPEAT = HEARTBEAT  # ns between two repetitions of the same bids, which may be lost: they are the sign of life, too
NO_BID = Bid(0.0, NOBODY)
LISTENING = SECOND  # ns for which a process that is younger than the order waits for its own old bids


def most_cost(swarm: Swarm) -> float:
    """Return the largest cost of a place, m^2: the fence's diagonal, squared."""
    return dist(swarm.limits.fence.low, swarm.limits.fence.high) ** 2


class PlaceAuction:
    """Follower `number`'s part in the auctions of `shapes`, by name in an order; its process began at `born` (Unix ns).

    Each order into such a formation begins an auction; an order that interrupts it leaves the place as it is. A drone
    that is left out does not bid.
    `rejected` counts messages with bids that nobody can have made.
    """

    def __init__(self, swarm: Swarm, number: int, shapes: Mapping[str, Formation], born: int) -> None:
        self._number, self._born, self._kind = number, born, bids_of(len(swarm.followers))
        self._followers, self._auctioned, self._shapes = swarm.followers, swarm.auctioned, shapes
        self._rank, self._most_cost = swarm.followers.index(number), most_cost(swarm)
        self._order: Mission | None = None  # into a formation with an auction; None while another order is in force
        self._auction: Auction | None = None
        self._left_out = False  # of such a formation
        self._silent_until = 0  # Unix ns
        self._guessed = False  # whether its costs are by an estimate of a process that had just been started
        self._told: tuple[Bid, ...] | None = None
        self._repeat = 0  # when they are due again, Unix ns
        self.rejected = 0

    @property
    def ordered(self) -> bool:
        """Whether a formation with an auction is ordered."""
        return self._order is not None

    @property
    def place(self) -> int | None:
        """The rank of the place that it holds, None without one.

        A drone that is left out in flight has the place of its own rank, which nobody else may hold.
        """
        if self._left_out:
            return self._rank
        return self._auction.place if self._auction is not None else None

    def order(self, mission: Mission, now: int) -> None:
        """Receive the order in force, at `now` (Unix ns)."""
        if not mission.in_formation:
            self._order = None
            return
        self._auction, self._told = None, None
        auctioned = mission.formation in self._auctioned
        self._left_out = auctioned and self._number in mission.without
        self._order = mission if auctioned and not self._left_out else None
        old = mission.stamp <= self._born
        self._silent_until = now + LISTENING if old else 0

    def take(self, message: Any) -> None:  # noqa: ANN401
        """Receive a neighbour's bids; those of another order are ignored."""
        auction, order = self._auction, self._order
        if auction is None or order is None or (message.stamp, message.giver) != order.version:
            return
        try:
            auction.take([Bid(*bid) for bid in zip(message.prices, message.bidders, strict=True)])
        except ValueError:
            self.rejected += 1

    def step(self, phase: Phase, motion: Motion | None, leader: LeaderMotion | None, now: int) -> Any:  # noqa: ANN401
        """Bid if it holds no place; return the bids to publish at `now` (Unix ns), None: none.

        They are due when they have changed, and again and again. The costs are fixed at the first step that knows the
        drone's `motion` and its `leader` estimate, and that may bid: the first estimate of a young process is a guess.
        Until then it passes bids on.
        """
        order, here, listens = self._order, _from_leader(motion, leader), now < self._silent_until
        if order is None:
            return None
        auction = self._current(order, here, listens, now)
        if phase in BIDDING and not (listens or self._guessed):
            auction.bid()
        bids = tuple(auction.bids)
        if here is None and bids.count(NO_BID) == len(bids):
            return None
        if bids == self._told and now < self._repeat:
            return None
        self._told, self._repeat = bids, now + REPEAT
        return self._kind(*order.version, *zip(*bids, strict=True))

    def _current(self, order: Mission, here: Vector | None, listens: bool, now: int) -> Auction:
        """Return the auction of `order`, again if it holds no place by guessed costs and now knows them."""
        auction, knows = self._auction, here is not None and not listens
        if auction is None or (self._guessed and knows and auction.place is None):
            auction, self._guessed = self._opened(order, here, now), not knows
        return auction

    def _opened(self, order: Mission, here: Vector | None, now: int) -> Auction:
        """Return the auction of `order` by the costs at present, with the bids that were known before."""
        known, most = self._auction, highest_price(len(self._followers), self._most_cost)
        bidders = frozenset(self._followers).difference(order.without)
        self._auction = Auction(self._number, self._costs(order, here, now), LEAST, most, bidders)
        if known is not None:
            self._auction.take(known.bids)
        return self._auction

    def reported(self, report: Report, malformed: int = 0) -> Report:
        """Return `report` with the place that it holds, and how many messages it rejected, beside those `malformed`."""
        if not (self.ordered or self.place is not None):
            return report
        rejected = self.rejected + malformed
        counts = (*report.counts, ("bids rejected", rejected)) if rejected else report.counts
        reasons = (*report.reasons, NO_PLACE_YET) if self.place is None else report.reasons
        return report._replace(place=self.place, reasons=reasons, counts=counts)

    def _costs(self, order: Mission, here: Vector | None, now: int) -> list[float]:
        """Return the squared distance of each place from `here`, relative to the leader, m^2; the most if it is None.

        In a change of formation it is that between the old place and the new one, half way, as the operator plans; the
        places of drones that are left out are not to be had.
        """
        change, at = order.change, max(now - order.start, 0) / SECOND
        if change is not None and now < change.begin + nanoseconds(change.duration):
            at = (change.begin - order.start) / SECOND + 0.5 * change.duration
            here = self._shapes[change.before].offset(change.places_before[self._rank], at)
        shape, ranks = self._shapes[order.formation], range(len(self._followers))
        ways = [dist(here, shape.offset(rank, at)) if here is not None else inf for rank in ranks]
        return [
            min(self._most_cost, way * way) if drone not in order.without else inf  # way ** 2 may raise OverflowError
            for way, drone in zip(ways, self._followers, strict=True)
        ]


def _from_leader(motion: Motion | None, leader: LeaderMotion | None) -> Vector | None:
    """Return where a drone is, relative to the leader, m; None unless both are known."""
    if motion is None or leader is None:
        return None
    return subtract(motion.position, leader.position)


NOBODYS: Mapping[int, int] = {}  # nobody knows the others' places by an auction


class AuctionedPlace(OrderedPlace):
    """The place that follower `number` holds by the auction; without one it waits where it is."""

    def __init__(self, swarm: Swarm, number: int, born: int) -> None:
        super().__init__(swarm, number)
        self._auction = PlaceAuction(swarm, number, self.formations, born)
        self._waiting, self._key = WaitingPlace(pilot_parameters(swarm, number)), Key("law", uav(number))
        self._ordered_ranks = self._known
        self._form = form = LawForm(bids_of(len(swarm.followers)))
        self._sender, weights = LawSender(form, Pace.STEP, swarm.frame, born), swarm.topology.neighbours(number)
        self._speakers = [Speaker(j, weight, False, form) for j, weight in weights.items() if j not in swarm.leaders]
        self.handlers = {Key("law", uav(one.number)): one.take for one in self._speakers}

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
        """Return its bids, if any are due, by those that arrived; or a sign of life."""
        for speaker in self._speakers:
            for heard in speaker.news:
                self._auction.take(heard.content)
            speaker.news = []
        bids = self._auction.step(phase, pilot.motion, leader, now)
        sent = self._sender.send(self._form.pack(bids) if bids is not None else None, now)
        return [(self._key, sent)] if sent is not None else []

    def reported(self, report: Report) -> Report:
        """Return `report` with the place that it holds."""
        return self._auction.reported(report, sum([one.rejected for one in self._speakers]))
