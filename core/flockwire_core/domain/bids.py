"""The bids of a follower for the places of a formation, as it publishes them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from flockwire_core.domain.order import Version

NOBODY = -1


class Bid(NamedTuple):
    """The greatest known bid for a place; a greater tuple outbids a lesser one."""

    price: float  # in the unit of the costs: m^2
    bidder: int  # number of the follower, NOBODY before the first bid


class Bids(NamedTuple):
    """The greatest bids that one follower knows, one for each place; they belong to one order."""

    stamp: int  # Unix ns, when it was published
    frame: str
    order: Version
    bids: tuple[Bid, ...]  # by rank of the place


def held_place(bids: Sequence[Bid], number: int) -> int | None:
    """Return the place that follower `number` holds by `bids`: that of its highest price, None without one.

    It has bids for two only after a restart, before the others have outbid the cheaper one.
    """
    own = [(bid.price, -place) for place, bid in enumerate(bids) if bid.bidder == number]
    return -max(own)[1] if own else None
