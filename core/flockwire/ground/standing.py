"""The standing order of one giver: its own newest, or another's that it follows; resolves rival orders."""

from __future__ import annotations

from flockwire.domain.marks import sometimes
from flockwire.domain.order import Mission
from flockwire.domain.time import SECOND
from flockwire.ground.fleet import Fleet
from flockwire.ground.knowledge import Knowledge
from flockwire.pilot.orders import rank

RIVALS = 4.0  # s, largest age difference of orders that crossed on slow networks


class Standing(Knowledge):
    """A giver's Knowledge, and its standing order.

    `order` is None before the first; it is this giver's or a followed one, since `since` (Unix ns).
    """

    def __init__(self, giver: int, asked: int) -> None:
        super().__init__(giver, asked)
        self.order: Mission | None = None
        self.started: Mission | None = None  # the newest of those that fly a formation
        self.since = asked

    @property
    def is_own(self) -> bool:
        """Whether this giver gave the order."""
        return self.order is not None and self.order.giver == self._giver

    def give(self, order: Mission) -> Mission:
        """Return `order` as this giver's, with its known orders; it stands from its stamp on."""
        order = super().give(order)
        self.follow(order, order.stamp)
        return order

    def follow(self, order: Mission, now: int) -> None:
        """Follow `order` as the standing one since `now` (Unix ns)."""
        self.order, self.since = order, now
        self.started = order if order.in_formation else self.started

    def settle(self, fleet: Fleet) -> bool:
        """If some pilots obey a rival upward order, put the one with the larger number in force for all.

        It is given again with both orders known; returns True if this giver did. A much older order of a pilot that was
        away is not a rival.
        """
        own = self.order
        if own is None or rank(own) or (rival := fleet.rival(own)) is None or (other := rival.mission) is None:
            return False
        if other.giver > own.giver and rival.order_age < (fleet.now - self.since) / SECOND + RIVALS:
            sometimes("station: follows a rival order")
            self.follow(other, fleet.now)
        elif self.is_own:
            sometimes("station: gives its own order again over a rival")
            self.give(own._replace(stamp=fleet.now))
            return True
        return False
