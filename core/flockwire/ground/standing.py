"""The order of one giver that stands: its own newest, or another's that it follows; of two rivals one holds for all."""

from __future__ import annotations

from flockwire.domain.order import Mission
from flockwire.domain.time import SECOND
from flockwire.ground.fleet import Fleet
from flockwire.ground.knowledge import Knowledge
from flockwire.pilot.orders import rank

RIVALS = 4.0  # s by which an order may be older than one that crossed it on slow networks


class Standing(Knowledge):
    """What `giver` knows (Knowledge), and the order that stands for it.

    `order` is None before the first; it is this giver's, or followed, since `since` (Unix ns).
    """

    def __init__(self, giver: int, asked: int) -> None:
        super().__init__(giver, asked)
        self.order: Mission | None = None
        self.started: Mission | None = None  # the newest of those that fly a formation
        self.since = asked

    @property
    def is_own(self) -> bool:
        """Whether there is an order, and this giver gave it."""
        return self.order is not None and self.order.giver == self._giver

    def give(self, order: Mission) -> Mission:
        """Return `order` as this giver's, with what it knows; it stands from its stamp on."""
        order = super().give(order)
        self.follow(order, order.stamp)
        return order

    def follow(self, order: Mission, now: int) -> None:
        """Take `order` for the one that stands since `now` (Unix ns)."""
        self.order, self.since = order, now
        self.started = order if order.in_formation else self.started

    def settle(self, fleet: Fleet) -> bool:
        """Where some pilots obey another order that takes up, have the one with the larger number hold for all.

        It is given again, from what both ordered: returns True where this giver did. What a pilot obeys for much longer
        is no rival: it was away.
        """
        own = self.order
        if own is None or rank(own) or (rival := fleet.rival(own)) is None or (other := rival.mission) is None:
            return False
        if other.giver > own.giver and rival.order_age < (fleet.now - self.since) / SECOND + RIVALS:
            self.follow(other, fleet.now)
        elif self.is_own:
            self.give(own._replace(stamp=fleet.now))
            return True
        return False
