"""The log of orders that the gateway keeps: it numbers each order, and decides which orders that take up are accepted.

A proposal names the number of the log that it was made from. It is accepted if that is the log's number still: compare
and set in one place. So no order takes up without knowledge of a hold or a landing, and of two that cross one is
accepted. A hold and a landing need no knowledge. A landing outranks a hold.
"""

from __future__ import annotations

from flockwire_core.domain.order import MOST_VERSIONS, Mission, Version
from flockwire_core.domain.time import SECOND
from flockwire_core.pilot.orders import interrupting, rank
from flockwire_core.wire.status import Counts, Report, counted

AHEAD = SECOND  # ns by which the stamp of a proposal may be ahead
BELIEVED = 1000  # numbers above its own that a gateway learns from pilots
UNDECIDED = 5 * SECOND  # ns for the pilots to report whether they obey the kept order


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
