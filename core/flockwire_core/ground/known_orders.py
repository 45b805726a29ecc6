"""The orders that a station knows: those that it gave, that the gateway repeats, or that every pilot obeys.

A pilot's report is evidence of what one drone does, never an order: a follower that was taken over may claim to obey
anything. So only the version of the order that a pilot names counts; the content is of the station, the gateway, or all
pilots alike.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from flockwire_core.domain.order import Mission, Version
from flockwire_core.pilot.orders import CAME_DOWN, REMEMBERED
from flockwire_core.wire.processes import GATEWAY
from flockwire_core.wire.status import Report, Status


class KnownOrders:
    """Orders by version; `count` grows with each one that is learnt."""

    def __init__(self) -> None:
        self.count = 0
        self._orders: dict[Version, Mission] = {}

    def get(self, version: Version) -> Mission | None:
        """Return the order of that version, None if it is not known."""
        return self._orders.get(version)

    def learn(self, order: Mission) -> None:
        """Take an order that this station gave, or that the gateway repeats with the formation that it interrupts."""
        known = self._orders.get(order.version)
        if known is not None and (known == order or known.start):
            return
        self.count += 1
        self._orders[order.version] = order
        while len(self._orders) > REMEMBERED:
            del self._orders[next(iter(self._orders))]

    def read(self, status: Status) -> None:
        """Learn the orders that a status of the gateway names."""
        if status.identity == GATEWAY.kind:
            self._learn_all(status.report.mission, status.report.concurrent)

    def compare(self, reports: Sequence[Report | None]) -> None:
        """Learn the order that the reports of all pilots name alike; nothing while one is missing."""
        orders = {report.mission if report is not None else None for report in reports}
        if len(orders) == 1:
            concurrent = [set(report.concurrent) for report in reports if report is not None]
            self._learn_all(orders.pop(), set.intersection(*concurrent) if concurrent else ())

    def _learn_all(self, order: Mission | None, concurrent: Iterable[Version]) -> None:
        """Learn an order, and beside a landing the holds among the `concurrent` versions."""
        if order is None:
            return
        self.learn(order)
        if order.verb == "land":
            for stamp, giver in concurrent:
                if not giver & CAME_DOWN:
                    self.learn(order._replace(verb="hold", stamp=stamp, giver=giver))

    def checked(self, status: Status) -> Status:
        """Return a status with the known content of its order; of an unknown one only the version remains."""
        report = status.report
        claimed = report.mission
        if status.identity == GATEWAY.kind or claimed is None or (known := self.get(claimed.version)) == claimed:
            return status
        if known is None:
            report = report._replace(mission=None, concurrent=(claimed.version, *report.concurrent))
        else:
            report = report._replace(mission=known)
        return status._replace(report=report)
