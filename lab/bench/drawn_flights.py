"""Drawn virtual flights, family by family: one command for all campaigns of correctness.

    .compiled/bin/python lab/bench/drawn_flights.py [--only FAMILY ...] [--flights 1000] [--first 0] [--jobs 2]
    .compiled/bin/python lab/bench/drawn_flights.py --only "rare faults" --seed N        (one again, told step by step)

`faults` are short flights of the paper's swarm with one to three faults, also of multirotors; `rare faults` meet more
(fault_judge.py); `stacked` are three drones above each other without poses (stacked.py). `pairs` and `sequences` are
orders of several stations (order_pairs.py, order_sequences.py), `laws` those that know no safety, alone, with
multirotors and among people (hostile.py), `own poses`, also of multirotors, and `lies` those of the tracker
(bodies.py). A bad flight, or one
whose code raises, is printed with its seed. Without --only the families take turns; --seconds ends one process after
so much processor time. The status is 1 if any flight was bad; at the end stands what the flights showed.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, field
from math import inf
from multiprocessing import Pool
from time import process_time

import bodies
import fault_draws
import fault_judge
import hostile
import order_pairs
import order_sequences
import stacked
from flockwire_lab import coverage


@dataclass(frozen=True)
class Flown:
    """One flight: what is bad of it (empty: nothing), and what else is counted of it."""

    family: str
    seed: int
    bad: str
    closest: float = inf  # m, between two drones in the air
    events: dict[str, int] = field(default_factory=dict)


def _breached(result: hostile.Result) -> str:
    return ", ".join(f"{what} {margin:+.3f} m" for what, margin in result.breached.items())


FAMILIES: dict[str, Callable[[int], str | fault_judge.Result]] = {  # what is bad of a seed's flight, or its result
    "faults": fault_judge.fly,
    "rare faults": fault_judge.fly_rare,
    "faults with multirotors": lambda seed: fault_judge.Judge(fault_draws.drawn(seed, multirotors=True)).fly(),
    "stacked": lambda seed: fault_judge.Judge(stacked.drawn(seed)).fly(),
    "pairs": lambda seed: order_pairs.fly(order_pairs.case_of(seed)).wrong,
    "sequences": lambda seed: order_sequences.fly(seed).wrong,
    "laws": lambda seed: _breached(hostile.fly(hostile.point_of(seed))),
    "laws with multirotors": lambda seed: _breached(hostile.fly_multirotors(hostile.point_of(seed))),
    "laws among people": lambda seed: _breached(hostile.fly(hostile.point_of(seed), people=True)),
    "own poses": lambda seed: "" if bodies.fly_honest(seed) else "taken for another body",
    "own poses of multirotors": lambda seed: "" if bodies.fly_honest(seed, "multirotor") else "taken for another body",
    "lies": lambda seed: "" if bodies.fly_lie(*bodies.lie_of(seed))[1] else "missed, or harmed somebody",
}
TOLD = {"faults": fault_judge.fly, "rare faults": fault_judge.fly_rare}  # families that tell what happens


def fly(flight: tuple[str, int]) -> Flown:
    """Fly one; whatever its code raises is bad."""
    family, seed = flight
    try:
        found = FAMILIES[family](seed)
    except Exception as error:
        return Flown(family, seed, f"{type(error).__name__}: {error}")
    if isinstance(found, str):
        return Flown(family, seed, found)
    return Flown(family, seed, "; ".join(found.bad), found.closest, found.events)


def flown(flights: list[tuple[str, int]], jobs: int, seconds: float) -> Iterator[Flown]:
    """Yield the flights, in order, for `seconds` of this process's time if it flies them itself."""
    if jobs > 1:
        with Pool(jobs) as pool:
            yield from pool.imap(fly, flights, chunksize=2)
        return
    for flight in flights:
        yield fly(flight)
        if process_time() >= seconds:
            return


def main() -> int:
    """Fly all, or one; returns 1 when something was bad."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", choices=FAMILIES, default=list(FAMILIES), metavar="FAMILY")
    parser.add_argument("--flights", type=int, default=1000, help="of each family")
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=inf, help="of processor time after which it ends")
    parser.add_argument("--seed", type=int, help="fly this one alone")
    options = parser.parse_args()
    if options.seed is not None:
        told = TOLD.get(options.only[0])
        print(json.dumps(asdict(told(options.seed, print)), indent=1) if told else fly((options.only[0], options.seed)))
        return 0
    seeds = range(options.first, options.first + options.flights)
    found, bad = list[Flown](), Counter[str]()
    for one in flown([(family, seed) for seed in seeds for family in options.only], options.jobs, options.seconds):
        found.append(one)
        if one.bad:
            bad[one.family] += 1
            print(f"bad: {one.family}, seed {one.seed}: {one.bad}", flush=True)
    if shown := [one.events for one in found if one.events]:
        print(*coverage.table(shown), sep="\n")
    for family, count in Counter(one.family for one in found).items():
        closest = min(one.closest for one in found if one.family == family)
        print(f"{family}: {bad[family]} bad of {count}{f', nearest {closest:.3f} m' if closest < inf else ''}")
    return int(any(bad.values()))


if __name__ == "__main__":
    sys.exit(main())
