"""The orders that one giver knows, and its standing order: its own newest, or another's that it follows."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from flockwire_core.domain.order import MOST_VERSIONS, Mission, Version
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.ground.fleet import Fleet
from flockwire_core.ground.known_orders import KnownOrders
from flockwire_core.pilot.orders import CAME_DOWN, rank
from flockwire_core.wire.status import Report

HISTORY = 16  # named orders that are no longer in force, for a pilot that missed their end
RIVALS = 4.0  # s, largest age difference of orders that crossed on slow networks


class Standing:
    """The orders in force that `giver` (a unique number, 31 bits) knows, and its standing order.

    Its own was requested at `asked` (Unix ns). The arrival of another's order is the time since pilots received it:
    only the own clock is used. `order` is None before the first; it is this giver's or a followed one, since `since`
    (Unix ns). From pilots it learns versions only (ground/known_orders.py); one that is not known within RIVALS s
    is a number that the next order names.
    """

    def __init__(self, giver: int, asked: int) -> None:
        self.order: Mission | None = None
        self.started: Mission | None = None  # the newest of those that fly a formation
        self.since = asked
        self._giver, self._asked, self._last = giver, asked, 0
        self._heard: set[str] = set()  # processes whose reports were read
        self._looked: object = None  # what the last look read
        self._news: dict[Version, int] = {}  # new versions whose orders are not known yet, since when (Unix ns)
        self._unclear: dict[int, int] = {}  # drones whose pilots obey an order that is not known, since when (Unix ns)
        self._known: dict[Version, None] = {}  # orders, those in force last
        self._count = 0  # the number of these in force
        self.holding: Mission | None = None  # the order in force at the last look

    @property
    def is_own(self) -> bool:
        """Whether this giver gave the order."""
        return self.order is not None and self.order.giver == self._giver

    def look(self, fleet: Fleet) -> Mission | None:
        """Receive the orders in force; return another's new order, None if there is none.

        It returns the order with the highest rank, even if another landing is already in force, or a hold came to
        landing drones. The order of a pilot that reports for the first time is not new if it was received before this
        giver's request.
        """
        reports = dict(fleet.reports())
        now = fleet.now
        self._unclear = {drone: self._unclear.get(drone, now) for drone in fleet.fresh if fleet.names_unknown(drone)}
        looked = fleet.known.count, [(name, report.mission, report.concurrent) for name, report in reports.items()]
        self.holding = fleet.mission()
        if looked == self._looked:  # nothing has changed
            return None
        self._looked = looked
        before, holding = frozenset(self._known), dict[Version, None]()
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
        news = {version: since for version, since in self._news.items() if version in holding}
        for identity, report in reports.items():
            for version in report.newest:
                heard = identity in self._heard or self._is_late(version, reports.values(), now)
                if heard and version not in before and version.giver != self._giver and not version.giver & CAME_DOWN:
                    news.setdefault(version, now)
        self._heard.update(reports)
        orders = [order for report in reports.values() for order in self._orders(report, fleet.known)]
        self._news = {version: since for version, since in news.items() if fleet.known.get(version) is None}
        return max((order for order in orders if order.version in news), key=rank, default=None)

    def unclear(self, now: int) -> bool:
        """Return whether a pilot names an order that may still become known at `now` (Unix ns)."""
        return any(now - since < RIVALS * SECOND for since in self._unclear.values())

    def give(self, order: Mission) -> Mission:
        """Return `order` as this giver's, with its known orders and its own version; it stands from its stamp on."""
        self._last = max(order.stamp, self._last + 1)
        self._looked = None  # the next look reads all again
        unclear = {version for version, since in self._news.items() if order.stamp - since < RIVALS * SECOND}
        known = tuple([version for version in self._known if version not in unclear][-max(HISTORY, self._count) :])
        order = order._replace(stamp=self._last, giver=self._giver, knows=known)
        self._known[order.version] = None
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
        if own is None or rank(own):
            return False
        if (rival := fleet.rival(own)) is None or (other := rival.mission) is None:
            self._name_unknown(own, fleet)
            return False
        if other.giver > own.giver and rival.order_age < (fleet.now - self.since) / SECOND + RIVALS:
            self.follow(other, fleet.now)
        elif self.is_own:
            self.give(own._replace(stamp=fleet.now))
            return True
        return False

    def _name_unknown(self, own: Mission, fleet: Fleet) -> None:
        """Give the own order again with the versions that a pilot has named for RIVALS and that nobody repeats."""
        limit = fleet.now - nanoseconds(RIVALS)
        old = [drone for drone, since in self._unclear.items() if since <= limit and drone in fleet.fresh]
        versions = {version for drone in old for version in fleet.fresh[drone].report.concurrent}
        if self.is_own and self.since <= limit and not versions.issubset((*own.knows, own.version)):
            self.give(own._replace(stamp=fleet.now))

    def _orders(self, report: Report, known: KnownOrders) -> Iterator[Mission]:
        """Yield others' orders that a pilot names and that are `known`; an upward one only if it is in force."""
        mission = report.mission
        if mission is None:
            return
        for version in report.newest:
            order = known.get(version)
            if order is None or version.giver == self._giver:
                continue
            if version == mission.version and (rank(mission) or mission == self.holding):
                yield mission
            elif version != mission.version and mission.verb == "land":
                yield order

    def _is_late(self, version: Version, reports: Iterable[Report], now: int) -> bool:
        """Return whether pilots received an order after this giver's request."""
        ages = [report.order_age for report in reports if version in report.newest]
        return now - nanoseconds(max(ages)) > self._asked
