"""Orders that the gateway repeats, as a station knows them."""

from collections.abc import Iterable

from flockwire_core.ground.known_orders import KnownOrders
from flockwire_core.wire.status import Status


def repeated(statuses: Iterable[Status]) -> KnownOrders:
    """Return what is known when the gateway has repeated each order that `statuses` name."""
    known = KnownOrders()
    for status in statuses:
        known.read(status._replace(identity="gateway"))
    return known
