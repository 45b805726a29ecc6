"""A distributed assignment: the followers share the places out by an auction on the links that exist.

Follower i pays a cost c_ij for place j. It knows the price p_j of each place and the bidder b_j who offered it, as far
as its neighbours' bids have reached it:

    (p_j, b_j) <- the greatest of its own and its in-neighbours' pairs, by price, then by bidder        (consensus)
    if b_j is another for its own place j, or it has none:                                               (bid)
        j = argmin_k (c_ik + p_k),   v = c_ij + p_j,   w = min_{k != j} (c_ik + p_k)
        p_j <- p_j + (w − v) + epsilon_i,   b_j <- i

(Bertsekas 1988; distributed: Zavlanos, Spesivtsev and Pappas 2008). Prices only rise, and the greatest pair is the same
in whatever order pairs arrive and however often: lost, late and repeated bids only delay it. If the links lead from
every follower to every other one, it ends with one place for each, and the sum of costs is at most

    sum c <= least sum + sum_i epsilon_i,    epsilon_i = max(TOLERANCE min_j c_ij, least)        (ours)

As min_j c_ij, summed, is a lower bound of the least sum, that is at most (1 + TOLERANCE) times the least sum plus N
times `least`: each follower chooses its own epsilon, and nobody needs to know the least sum.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from typing import NamedTuple

NOBODY = -1
TOLERANCE = 0.1  # share of the least sum by which the result may be above it


class Bid(NamedTuple):
    """The greatest known bid for a place; a greater tuple outbids a lesser one."""

    price: float  # in the unit of the costs
    bidder: int  # number of the follower, NOBODY before the first bid


class Auction:
    """The part of follower `number` >= 0, which pays `costs[j]` >= 0 for place j.

    Costs are finite; `least` > 0 is the smallest step of a price, in their unit. Raises ValueError otherwise.
    """

    def __init__(self, number: int, costs: Sequence[float], least: float) -> None:
        if number < 0:
            raise ValueError(f"number = {number}: must be 0 or more")
        if not costs or not all(0.0 <= cost < inf for cost in costs):
            raise ValueError(f"costs = {list(costs)}: must be one or more, finite, none negative")
        if not 0.0 < least < inf:
            raise ValueError(f"least = {least}: must be positive and finite")
        self._number, self._costs = number, tuple(costs)
        self._step = max(TOLERANCE * min(costs), least)
        self.bids = [Bid(0.0, NOBODY)] * len(costs)  # to publish
        self.place: int | None = None  # the place that it holds, as far as it knows

    def take(self, bids: Sequence[Bid]) -> None:
        """Receive a neighbour's bids, one for each place; raises ValueError for others: all of them are dropped."""
        if len(bids) != len(self.bids) or not all(0.0 <= bid.price < inf and bid.bidder >= NOBODY for bid in bids):
            raise ValueError(f"bids = {list(bids)}: must be one for each of {len(self.bids)} places, at a finite price")
        for j, bid in enumerate(bids):
            self.bids[j] = max(self.bids[j], bid)
        if self.place is not None and self.bids[self.place].bidder != self._number:
            self.place = None

    def bid(self) -> None:
        """Bid for the best place, unless it holds one."""
        if self.place is not None:
            return
        values = [cost + bid.price for cost, bid in zip(self._costs, self.bids, strict=True)]
        best = min(range(len(values)), key=values.__getitem__)
        second = min((value for j, value in enumerate(values) if j != best), default=values[best])
        price = self.bids[best].price + (second - values[best]) + self._step
        self.bids[best], self.place = Bid(price, self._number), best
