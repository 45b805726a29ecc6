"""The codec of bids."""

from __future__ import annotations

from math import inf

from flockwire.domain.bids import NOBODY, Bid, Bids
from flockwire.domain.order import Version
from flockwire.wire.cdr import MessageError, Reader, Writer


def write_bids(writer: Writer, message: Bids) -> None:
    """Append bids, after their stamp and frame."""
    writer.time(message.order.stamp)
    writer.put("I", message.order.giver)
    writer.put("I", len(message.bids))
    for price, bidder in message.bids:
        writer.put("d", price)
        writer.put("i", bidder)


def read_bids(stamp: int, frame: str, reader: Reader) -> Bids:
    """Read the output of `write_bids`; raises MessageError, also for a price or a bidder that cannot be."""
    order = Version(reader.time(), reader.take("I"))
    bids = tuple([Bid(reader.take_all("d", 1)[0], reader.take("i")) for _ in range(reader.length())])
    for price, bidder in bids:
        if not 0.0 <= price < inf or bidder < NOBODY:
            raise MessageError(f"a bid of {price} by {bidder}")
    return Bids(stamp, frame, order, bids)
