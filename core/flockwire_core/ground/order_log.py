"""The log of orders that the gateway keeps, and what one giver of orders knows of it.

The gateway numbers each order, and decides which orders that take up are accepted. A proposal names the number of the
log that it was made from. It is accepted if that is the log's number still: compare and set in one place. So no order
takes up without knowledge of a hold or a landing, and of two that cross one is accepted. A hold and a landing need no
knowledge. A landing outranks a hold.
"""

from __future__ import annotations

from flockwire_core.domain.order import MOST_VERSIONS, Mission, Version
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.ground.fleet import Fleet
from flockwire_core.pilot.orders import interrupting, rank
from flockwire_core.wire.status import NO_MISSION, Counts, Report, counted

AHEAD = SECOND  # ns by which the stamp of a proposal may be ahead
BELIEVED = 1000  # numbers above its own that a gateway learns from pilots
UNDECIDED = 5 * SECOND  # ns for the pilots to report whether they obey the kept order
PATIENCE = 4 * SECOND  # ns for an order that a pilot obeys to be in the log, too: longer than a network's delay
UNKNOWN = "a hold or a landing"  # one that another order has replaced since


class OrderLog:
    """The log at `now` (Unix ns), after the order `kept` by an earlier process; `pilots` are its pilots' identities.

    `order` is the one in force, with the log's number, None if there is none; `taken` is the time of the newest one,
    Unix ns. The kept order comes into force again when a pilot reports that it obeys it. Until all pilots have
    reported, no proposal is accepted.
    """

    def __init__(self, pilots: frozenset[str], now: int, kept: Mission | None = None) -> None:
        self.order: Mission | None = None
        self.taken: int | None = None
        self._kept, self._silent, self._began = kept, set(pilots), now
        self._number = 0 if kept is None else kept.number
        self._most = self._number + BELIEVED
        self._refused: Version | None = None
        self._refusals = 0

    @property
    def counts(self) -> Counts:
        """The number of refused proposals, for a status."""
        return counted(("orders rejected", self._refusals))

    def age(self, now: int) -> float:
        """Return the time, s, since the newest order at `now` (Unix ns); -1 before the first."""
        return -1.0 if self.taken is None else (now - self.taken) / SECOND

    def take(self, order: Mission, now: int) -> bool:
        """Receive an order at `now` (Unix ns); returns whether the log has a new number."""
        was = self.order
        if was is not None and was.has(order):
            return False
        if not rank(order) and not self._accepts(order, now):
            if order.version != self._refused:
                self._refused = order.version
                self._refusals += 1
            return False
        self._number, self.taken, self._kept = max(self._number, order.number) + 1, now, None
        downs = () if was is None else was.downs
        if rank(order):
            downs = (*downs, order.version)[-MOST_VERSIONS:]
        if was is None or not 0 < rank(order) < rank(was):  # a hold cancels no landing
            was = interrupting(order, was)
        self.order = was._replace(number=self._number, downs=downs)
        return True

    def learn(self, pilot: str, report: Report, now: int) -> bool:
        """Learn from a pilot's report which number it has seen, and whether it obeys the kept order.

        Returns whether the order in force has another number. A report is no order: nothing else is learnt from it.
        """
        self._silent.discard(pilot)
        obeyed, was = report.mission, self.order
        if self._kept is not None and was is None:
            if obeyed is not None and obeyed.version == self._kept.version:
                self.order, self.taken, self._kept = self._kept, now, None
            elif not self._is_undecided(now):
                self._kept = None
        if obeyed is None or not self._number < obeyed.number <= self._most:
            return self.order is not was
        self._number = obeyed.number
        if self.order is not None:
            self._number += 1
            self.order = self.order._replace(number=self._number)
        return self.order is not was

    def _accepts(self, order: Mission, now: int) -> bool:
        if order.given > now + AHEAD or (self._kept is not None and self._is_undecided(now)):
            return False
        return order.number >= self._number or (self.order is None and not order.number)

    def _is_undecided(self, now: int) -> bool:
        return bool(self._silent) and now - self._began < UNDECIDED


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
