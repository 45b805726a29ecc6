"""Drawn virtual flights of every family in turn, until one is bad: one command for all of them.

    .compiled/bin/python lab/bench/drawn_flights.py [--rounds 1000] [--first 0] [--seconds S]

A round is a flight with drawn faults, and one with rare ones (fault_flights.py), a sequence of orders
(order_sequences.py), a law that knows no safety, alone and among people (hostile.py), and a flight with poses that are
the drone's own (bodies.py). The first bad one, or one whose code raises, ends it with status 1 and its family, seed and
reason; S seconds of processor time end it, too.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator
from math import inf
from time import process_time

import bodies
import fault_judge
import hostile
import order_sequences


def _breached(result: hostile.Result) -> str:
    return ", ".join(f"{what} {margin:+.3f} m" for what, margin in result.breached.items())


FAMILIES: dict[str, Callable[[int], str]] = {  # what is bad of the flight of a seed, empty when nothing is
    "faults": lambda seed: "; ".join(fault_judge.fly(seed).bad),
    "rare faults": lambda seed: "; ".join(fault_judge.fly_rare(seed).bad),
    "orders": lambda seed: order_sequences.fly(seed).wrong,
    "laws": lambda seed: _breached(hostile.fly(hostile.point_of(seed))),
    "laws among people": lambda seed: _breached(hostile.fly(hostile.point_of(seed), people=True)),
    "own poses": lambda seed: "" if bodies.fly_honest(seed) else "taken for another body",
}


def flights(seeds: range) -> Iterator[tuple[str, int, str]]:
    """Fly all families by `seeds`; yield the family and seed of each flight, and what is bad."""
    for seed in seeds:
        for family, fly in FAMILIES.items():
            try:
                bad = fly(seed)
            except Exception as error:  # whatever a flight's code raises is bad
                bad = f"{type(error).__name__}: {error}"
            yield family, seed, bad


def main() -> int:
    """Fly until one is bad; returns 1 then."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=1000)
    parser.add_argument("--first", type=int, default=0, help="the first round")
    parser.add_argument("--seconds", type=float, default=inf, help="of processor time after which it ends")
    options = parser.parse_args()
    flown = 0
    for family, seed, bad in flights(range(options.first, options.first + options.rounds)):
        flown += 1
        if bad:
            print(f"bad: {family}, seed {seed}: {bad}")
            return 1
        if process_time() >= options.seconds:
            break
    print(f"none of {flown} flights was bad")
    return 0


if __name__ == "__main__":
    sys.exit(main())
