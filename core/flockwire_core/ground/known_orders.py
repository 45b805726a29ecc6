"""What one giver of orders knows of the gateway's log, and the order that it stands for."""

from __future__ import annotations

from flockwire_core.domain.order import Mission, Version
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.ground.fleet import Fleet
from flockwire_core.pilot.orders import rank
from flockwire_core.wire.status import NO_MISSION

PATIENCE = 4 * SECOND  # ns for an order that a pilot obeys to be in the log, too: longer than a network's delay
UNKNOWN = "a hold or a landing"  # one that another order has replaced since


class KnownOrders:
    """The log as `giver` (a unique number, 31 bits) has read it, and its order: its own newest, or one that it follows.

    Its own was requested at `asked` (Unix ns). The arrival of another's order is the time since the gateway received
    it: only the own clock is used. `order` is None before the first; it is in force here since `since` (Unix ns).
    """

    def __init__(self, giver: int, asked: int) -> None:
        self.order: Mission | None = None
        self.started: Mission | None = None  # the newest of those that fly a formation
        self.since = asked
        self._giver, self._asked, self._last = giver, asked, 0
        self._log: Mission | None = None  # as read last, NO_MISSION without an order; None before the first reading
        self._made_from: Version | None = None  # the order in force when the own one was made
        self._unclear: dict[int, int] = {}  # drones whose pilots obey an order that is not in the log, since when

    @property
    def is_own(self) -> bool:
        """Whether this giver gave the order."""
        return self.order is not None and self.order.giver == self._giver

    def read(self, fleet: Fleet) -> str:
        """Read the log; return the verb of a hold or a landing of another giver that is new, empty if there is none.

        At first an order is new if the gateway received it after this giver's request.
        """
        self._unclear = {drone: self._unclear.get(drone, fleet.now) for drone in fleet.unclear()}
        age = fleet.order_age
        if age is None:
            return ""
        was, self._log = self._log, fleet.mission() or NO_MISSION
        log = self._log
        if was is not None:
            return self._news(log, was)
        late = fleet.now - nanoseconds(age) > self._asked
        return log.verb if rank(log) and late and log.giver != self._giver else ""

    def _news(self, log: Mission, was: Mission) -> str:
        """Return as `read` does, for a `log` that is not read for the first time."""
        mine = all((stamp, giver) in was.downs or giver == self._giver for stamp, giver in log.downs)
        if log.number <= was.number or mine:
            return ""
        return log.verb if rank(log) else UNKNOWN

    def is_unclear(self, now: int) -> bool:
        """Return whether a pilot obeys an order that may still come into the log at `now` (Unix ns)."""
        return any(now - since < PATIENCE for since in self._unclear.values())

    def give(self, order: Mission) -> Mission:
        """Return `order` as this giver's: a proposal made from the log as read last, or a hold or a landing."""
        self._last = max(order.stamp, self._last + 1)
        log = self._log
        number, self._made_from = (0, None) if log is None or rank(order) else (log.number, log.version)
        self.follow(order._replace(stamp=self._last, giver=self._giver, number=number, downs=()), order.stamp)
        assert self.order is not None  # noqa: S101
        return self.order

    def follow(self, order: Mission, now: int) -> None:
        """Follow `order` since `now` (Unix ns)."""
        self.order, self.since = order, now
        self.started = order if order.in_formation else self.started

    def settle(self, now: int) -> bool:
        """If the log went on without this giver's upward order, follow another's, or give it again; return whether so.

        It is given again if only the number changed, or own orders came between.
        """
        own, log = self.order, self._log
        if own is None or log is None or rank(own) or log.version == own.version or log.number <= own.number:
            return False
        if not rank(log) and log.giver != self._giver and log.version != self._made_from:
            self.follow(log, now)
        elif self.is_own:
            self.give(own._replace(stamp=now))
            return True
        return False
