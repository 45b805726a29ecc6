"""How near to the optimum the distributed auction (control/auction.py) comes, and after how many rounds it ends.

    python lab/bench/auction.py [--cases 1000] [--seed 0]
    python lab/bench/auction.py --flights 200

Each case: 5, 9 or 12 followers start at random in 7 x 7 m, at least 0.6 m apart, a circle, grid or line has the places,
and the cost is the squared distance, as in the operator's assignment. The links are a random tree with both directions,
a one-way ring, or a random graph that joins all; bids are lost with a probability of 0 or 0.2. A round is one exchange
with the neighbours. Exit status 1 if two followers hold one place, or a cost is above the bound or more than 10 % above
the optimum.

`--flights` flies the agents themselves in virtual time, 5, 8 or 12 followers on random trees with both directions
(auction_flights.py). Exit status 1 if a flight fails a check, two hold one place, or one costs more than 10 % above.
"""

from __future__ import annotations

import argparse
import sys
from concurrent.futures import ProcessPoolExecutor
from itertools import product
from math import dist
from random import Random
from statistics import median
from typing import NamedTuple

from auction_flights import COUNTS, LOSSES, Flown, fly
from flockwire_core.control.assignment import least_cost
from flockwire_core.control.auction import LEAST, TOLERANCE, Auction
from flockwire_core.control.formation import Circle, Formation, Grid, Line

SIDE, APART = 7.0, 0.6  # m
MOST_ROUNDS = 20000
Links = list[tuple[int, int]]


class Case(NamedTuple):
    """The result of one case: sums of costs in m^2."""

    cost: float
    optimum: float
    rounds: int
    conflict: bool
    followers: int


def starts(count: int, chance: Random) -> list[tuple[float, float, float]]:
    """Return random starts, m."""
    found: list[tuple[float, float, float]] = []
    while len(found) < count:
        place = (SIDE * (chance.random() - 0.5), SIDE * (chance.random() - 0.5), 0.0)
        if all(dist(place, other) >= APART for other in found):
            found.append(place)
    return found


def tree(count: int, chance: Random) -> Links:
    """Return the links of a random tree, both ways."""
    pairs = [(chance.randrange(i), i) for i in range(1, count)]
    return pairs + [(j, i) for i, j in pairs]


def ring(count: int, chance: Random) -> Links:
    """Return the links of a one-way ring in random order."""
    order = chance.sample(range(count), count)
    return list(zip(order, order[1:] + order[:1], strict=True))


def graph(count: int, chance: Random) -> Links:
    """Return a one-way ring and as many further links."""
    rest = [(i, j) for i in range(count) for j in range(count) if i != j]
    return sorted({*ring(count, chance), *chance.sample(rest, count)})


def shape(kind: str, count: int) -> Formation:
    """Return a formation of `count` followers."""
    if kind == "circle":
        return Circle(count, 1.5, 0.0)
    return Grid(count, 1.0, 3, 0.0) if kind == "grid" else Line(count, 0.6, 0.0, 0.0)


def agreed(agents: list[Auction]) -> bool:
    """Return whether each holds a place, and all know the same bids."""
    return all(agent.place is not None and agent.bids == agents[0].bids for agent in agents)


def run(number: int, seed: int) -> Case:
    """Run one case."""
    chance = Random(f"{seed} {number}")
    kinds = tuple(product((5, 9, 12), ("circle", "grid", "line"), (tree, ring, graph), (0.0, 0.2)))
    count, kind, links_of, loss = kinds[number % len(kinds)]
    here, formation = starts(count, chance), shape(kind, count)
    places = [formation.offset(i, 0.0) for i in range(count)]
    costs = [[dist(x, place) ** 2 for place in places] for x in here]
    links = links_of(count, chance)
    agents = [Auction(i, row, LEAST) for i, row in enumerate(costs)]
    rounds = 0
    while rounds < MOST_ROUNDS and not agreed(agents):
        rounds += 1
        for agent in agents:
            agent.bid()
        told = [tuple(agent.bids) for agent in agents]
        for source, target in links:
            if chance.random() >= loss:
                agents[target].take(told[source])
    held = [agent.place for agent in agents]
    conflict = any(held.count(j) != 1 for j in range(count))
    best = least_cost(costs)
    cost = sum(row[j] for row, j in zip(costs, held, strict=True) if j is not None)
    return Case(cost, sum(costs[i][j] for i, j in enumerate(best)), rounds, conflict, count)


def fly_all(flights: int, jobs: int) -> int:
    """Fly and print a table; returns the exit status."""
    with ProcessPoolExecutor(jobs) as pool:
        found = list(pool.map(fly, range(flights)))
    print("followers  loss  flights  failed  conflicts  agreed, s     settled, s    apart, m  above the optimum")
    for count, loss in product(COUNTS, LOSSES):
        some = [one for one in found if (one.followers, one.loss) == (count, loss)]
        if some:
            print(f"{count:9d}  {loss:4.1f}  {len(some):7d}  {row(some)}")
    for seed, one in enumerate(found):
        if one.failed or one.conflict:
            print(f"flight {seed}: places {one.places}: {one.failed}")
    print(f"bids rejected: {sum(one.rejected for one in found)}")
    return 1 if any(one.failed or one.conflict or one.cost > 1.1 * one.optimum + 1e-9 for one in found) else 0


def row(some: list[Flown]) -> str:
    """Return the figures of some flights."""
    agreed, settled = [one.agreed for one in some], [99.0 if one.settled is None else one.settled for one in some]
    apart = min((one.separation for one in some if one.separation is not None), default=0.0)
    above = [100.0 * (one.cost / one.optimum - 1.0) for one in some if one.optimum]
    return (
        f"{sum(bool(one.failed) for one in some):6d}  {sum(one.conflict for one in some):9d}"
        f"  {median(agreed):.2f} / {max(agreed):.2f}   {median(settled):.1f} / {max(settled):.1f}"
        f"    {apart:8.3f}  {median(above):.2f} / {max(above):.2f} %"
    )


def main() -> int:
    """Print the table; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--flights", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=1)
    args = parser.parse_args()
    if args.flights:
        return fly_all(args.flights, args.jobs)
    cases = [run(number, args.seed) for number in range(args.cases)]
    print("followers   cases   conflicts   above the optimum, median / worst   rounds, median / worst")
    for count in sorted({case.followers for case in cases}):
        some = [case for case in cases if case.followers == count]
        above, rounds = [100.0 * (c.cost / c.optimum - 1.0) for c in some], [c.rounds for c in some]
        print(
            f"{count:9d}   {len(some):5d}   {sum(c.conflict for c in some):9d}"
            f"   {median(above):14.2f} / {max(above):.2f} %{median(rounds):23.0f} / {max(rounds)}"
        )
    beyond = [c for c in cases if c.cost > (1.0 + TOLERANCE) * c.optimum + c.followers * LEAST + 1e-9]
    wide = [c for c in cases if c.cost > 1.1 * c.optimum + 1e-9]
    print(f"above the bound: {len(beyond)}; more than 10 % above the optimum: {len(wide)}")
    return 1 if beyond or wide or any(case.conflict for case in cases) else 0


if __name__ == "__main__":
    sys.exit(main())
