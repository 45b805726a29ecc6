"""Flights of the search, or as many draws, in one process until one violates a property: a column of mutants.py.

    .venv/bin/python bench/first_violation.py [--method search] [--flights 150] [--seed 0]

A leader and two followers under any faults (docs/study.md, "Search"). The first violation ends it with status 1.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable, Iterator

from flockwire.loading import parse_swarm
from flockwire_sim.search.flight import Judged, Order, fly_numbered
from flockwire_sim.search.seeking import Chooser, Draws, Search
from flockwire_sim.search.space import SearchPlan, Space, usual_space
from flockwire_sim.study.file import load_study
from search import METHODS, five


def space(seed: int) -> Space:
    """Return the space of flights of the paper's leader and its first two followers."""
    table = five()
    table["drones"], table["graph"] = table["drones"][:3], {"edges": [[0, 1], [1, 2]]}
    swarm = parse_swarm(table, "three drones")
    return Space(load_study(None, usual_space(table, swarm, "safety") | {"seed": seed}, SearchPlan), table, swarm)


def flown(where: Space, seeker: Chooser, flights: int) -> Iterator[tuple[int, Judged]]:
    """Yield the number of each flight, and what it showed."""
    number = 0
    while number < flights:
        asked, found = seeker.ask(), list[Judged]()
        orders: Iterable[Order] = enumerate((where.case(one.point, one.seed) for one in asked), number)
        for order in orders:
            if order[0] == flights:
                return
            found.append(fly_numbered(order)[1])
            yield order[0], found[-1]
        seeker.tell(asked, found)
        number += len(asked)


def main() -> int:
    """Fly; returns 1 with a violation, 2 if a flight could not be flown."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--method", choices=METHODS, default=METHODS[0])
    parser.add_argument("--flights", type=int, default=150)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    where = space(options.seed)
    seeker: Chooser = (Search if options.method == METHODS[0] else Draws)(where.size, options.seed)
    for number, judged in flown(where, seeker, options.flights):
        if judged.refused:
            print(f"flight {number}: {judged.refused}")
            return 2
        if judged.violations:
            print(f"flight {number}: {'; '.join(judged.violations)}")
            return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
