"""A distributed assignment: the followers share the places out by an auction on the links that exist.

Follower i pays a cost c_ij for place j. It knows the price p_j of each place and the bidder b_j who offered it, as far
as its neighbours' bids have reached it:

    (p_j, b_j) <- the greatest of its own and its in-neighbours' pairs, by price, then by bidder        (consensus)
    if it is the bidder of none:                                                                         (bid)
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

from collections.abc import Collection, Sequence
from functools import lru_cache
from math import inf, isfinite
from typing import Any, NamedTuple

NOBODY = -1
TOLERANCE = 0.1  # share of the least sum by which the result may be above it
LEAST = 0.01  # m^2, smallest step of a price


class Bid(NamedTuple):
    """The greatest known bid for a place; a greater tuple outbids a lesser one."""

    price: float  # in the unit of the costs: m^2
    bidder: int  # number of the follower, NOBODY before the first bid


@lru_cache(maxsize=16)
def bids_of(places: int) -> Any:  # noqa: ANN401  (a class)
    """Return the type of the message of the auction of so many `places`: the greatest bids that one follower knows.

    Prices and bidders are by rank of the place; they belong to the order of the `stamp` (Unix ns) and the `giver`.
    """
    prices, bidders = tuple[(float,) * places], tuple[(int,) * places]  # type: ignore[misc]
    return NamedTuple("Bids", [("stamp", int), ("giver", int), ("prices", prices), ("bidders", bidders)])


def held_place(bids: Sequence[Bid], number: int) -> int | None:
    """Return the place that follower `number` holds by `bids`: that of its highest price, None without one.

    It has bids for two only after a restart, before the others have outbid the cheaper one.
    """
    own = [(bid.price, -place) for place, bid in enumerate(bids) if bid.bidder == number]
    return -max(own)[1] if own else None


def highest_price(places: int, most_cost: float) -> float:
    """Return the highest price, which honest bidders do not reach, of so many places that cost `most_cost` at most."""
    return 4.0 * places * most_cost  # highest price, in the largest possible cost, for each place


class Auction:
    """The part of follower `number` >= 0, which pays `costs[j]` >= 0 for place j, inf for one that is not to be had.

    One cost at least is finite; `least` > 0 is the smallest step of a price, `most` > 0 the highest price, in their
    unit. `bidders` are the numbers that others may have. Raises ValueError for other values.
    """

    def __init__(
        self,
        number: int,
        costs: Sequence[float],
        least: float,
        most: float = inf,
        bidders: Collection[int] | None = None,
    ) -> None:
        if number < 0:
            raise ValueError(f"number = {number}: must be 0 or more")
        if not any(map(isfinite, costs)) or not all(cost >= 0.0 for cost in costs):
            raise ValueError(f"costs = {list(costs)}: one or more must be finite, none negative")
        if not 0.0 < least < inf or not most > 0.0:
            raise ValueError(f"least = {least}, most = {most}: must be positive, the first finite")
        self._number, self._costs, self._most, self._bidders = number, tuple(costs), most, bidders
        self._step = max(TOLERANCE * min(costs), least)
        self.bids = [Bid(0.0, NOBODY)] * len(costs)  # to publish
        self.place: int | None = None  # the place that it holds, as far as it knows

    def take(self, bids: Sequence[Bid]) -> None:
        """Receive a neighbour's bids, one for each place; raises ValueError for others: all of them are dropped."""
        if len(bids) != len(self.bids) or not all(map(self._is_possible, bids)):
            raise ValueError(f"bids = {list(bids)}: must be one of {len(self.bids)}, at a possible price, of a bidder")
        self.bids = [max(known, bid) for known, bid in zip(self.bids, bids, strict=True)]
        self.place = held_place(self.bids, self._number)

    def bid(self) -> None:
        """Bid for the best place, unless it holds one, or the price would be above the highest."""
        if self.place is not None:
            return
        values = [cost + bid.price for cost, bid in zip(self._costs, self.bids, strict=True)]
        best = min(range(len(values)), key=values.__getitem__)
        second = min((value for j, value in enumerate(values) if j != best and value < inf), default=values[best])
        price = self.bids[best].price + (second - values[best]) + self._step
        if price <= self._most:
            self.bids[best], self.place = Bid(price, self._number), best

    def _is_possible(self, bid: Bid) -> bool:
        if bid.bidder == NOBODY:
            return bid.price == 0.0
        known = bid.bidder >= 0 if self._bidders is None else bid.bidder in self._bidders
        return known and 0.0 <= bid.price < inf and bid.price <= self._most
