"""What one who gives orders knows of those that hold, and which of others' came after it was asked to give one."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from flockwire.domain.order import MOST_VERSIONS, Mission, Version
from flockwire.domain.time import nanoseconds
from flockwire.ground.fleet import Fleet
from flockwire.pilot.orders import CAME_DOWN, rank
from flockwire.wire.status import Report

HISTORY = 16  # orders that are named though they hold no more: for a pilot that missed what ended one


class Knowledge:
    """The orders that `giver` (a number of its own, 31 bits) knows of, which was asked at `asked`, Unix ns.

    When an order of another came is told by how long ago pilots took it in: no clock but the own decides.
    """

    def __init__(self, giver: int, asked: int) -> None:
        self._giver, self._asked, self._last = giver, asked, 0
        self._heard: set[str] = set()  # whose reports were looked at
        self._known: dict[Version, None] = {}  # those that hold now last
        self._count = 0  # how many of these hold now
        self.holding: Mission | None = None  # the order that held at the last look

    def look(self, fleet: Fleet) -> Mission | None:
        """Receive which orders hold; return another's that was not known before, None if there is none.

        Of several the one that outranks the others is returned: also where another landing holds already, and a hold
        that came to those who land. What a pilot reports that was not heard before is no news if it was taken in
        before this giver was asked.
        """
        before, holding, reports = frozenset(self._known), dict[Version, None](), dict(fleet.reports())
        for report in reports.values():
            holding.update(dict.fromkeys(report.newest))
            if report.mission is not None and report.mission.version not in before:
                self._known.update(dict.fromkeys(report.mission.knows))
        for version in holding:
            self._known.pop(version, None)
        self._known.update(holding)
        self._count = len(holding)
        while len(self._known) > MOST_VERSIONS:
            del self._known[next(iter(self._known))]
        self.holding = fleet.mission()
        news = [
            order
            for identity, report in reports.items()
            for order in self._orders(report)
            if order.version not in before
            and (identity in self._heard or self._is_late(order.version, reports.values(), fleet.now))
        ]
        self._heard.update(reports)
        return max(news, key=rank, default=None)

    def _orders(self, report: Report) -> Iterator[Mission]:
        """Yield the orders of others that a pilot obeys; beside a landing they are known by their versions alone."""
        mission = report.mission
        if mission is None:
            return
        others = [version for version in report.newest if version.giver != self._giver]
        for version in others:
            if version == mission.version and (rank(mission) or mission == self.holding):
                yield mission
            elif version != mission.version and mission.verb == "land" and not version.giver & CAME_DOWN:
                yield mission._replace(verb="hold", stamp=version.stamp, giver=version.giver)

    def give(self, order: Mission) -> Mission:
        """Return `order` as this giver's, with what it knows; each has a version of its own."""
        self._last = max(order.stamp, self._last + 1)
        known = tuple(self._known)[-max(HISTORY, self._count) :]
        order = order._replace(stamp=self._last, giver=self._giver, knows=known)
        self._known[order.version] = None
        return order

    def _is_late(self, version: Version, reports: Iterable[Report], now: int) -> bool:
        """Return whether pilots took in an order after this giver was asked to give one."""
        ages = [report.order_age for report in reports if version in report.newest]
        return now - nanoseconds(max(ages)) > self._asked
