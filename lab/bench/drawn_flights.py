"""Drawn virtual flights of every family in turn, until one is bad: one command for all of them.

    .venv-dev/bin/python lab/bench/drawn_flights.py [--rounds 1000] [--first 0] [--seconds S]

A round is a flight with drawn faults (fault_flights.py) and a sequence of orders (order_sequences.py); every fifth also
has a lost body, exchanged names and a visitor (lost_body.py, swaps.py, visitor.py). The first bad flight, or one whose
code raises, ends it with status 1 and its family, seed and reason; S seconds of processor time end it, too.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import sys
from collections.abc import Callable, Iterator
from functools import cache
from math import inf
from pathlib import Path
from time import process_time

import fault_judge
import hostile
import lost_body
import order_sequences
import swaps
import visitor
from flockwire_core.loading import load_swarm
from flockwire_core.swarm.model import Swarm

ROOT = Path(__file__).parents[2]
RARER = 5  # rounds from one flight of a rarer family to the next
PERSON = 1.0  # m/s at which a visitor walks
load = cache(load_swarm)


def faults(seed: int) -> str:
    """Fly with drawn faults; return what is bad, empty when nothing is."""
    return "; ".join(fault_judge.fly(seed).bad)


def orders(seed: int) -> str:
    """Fly a drawn sequence of orders; return what is bad."""
    return order_sequences.fly(seed).wrong


def lost(seed: int) -> str:
    """Fly with a drone that the tracker loses; return what is bad."""
    result = lost_body.fly(seed)
    return "" if result.well else result.row()


def names(seed: int) -> str:
    """Fly with two exchanged names; return what is bad."""
    return _printed(swaps.fly, load(ROOT / "examples/paper_simulation.toml"), seed)


def persons(seed: int) -> str:
    """Fly with a person in the field; return what is bad."""
    return _printed(visitor.fly, load(ROOT / "lab/bench/separation/five.toml"), seed, PERSON)


def laws(seed: int) -> str:
    """Fly a law that knows no safety; return what was not kept."""
    return _breached(hostile.fly(hostile.point_of(seed)))


def trapped(seed: int) -> str:
    """Fly such a law among people; return whether a person was not given way to, though there was a way."""
    return _breached(hostile.fly(hostile.point_of(seed), people=True))


FAMILIES: tuple[tuple[Callable[[int], str], int], ...] = (
    (faults, 1), (orders, 1), (lost, RARER), (names, RARER), (persons, RARER), (laws, 1), (trapped, RARER),
)  # with the rounds from one flight to the next  # fmt: skip


def _breached(result: hostile.Result) -> str:
    return ", ".join(f"{what} {margin:+.3f} m" for what, margin in result.breached.items())


def _printed(fly: Callable[..., bool], swarm: Swarm, *given: float) -> str:
    """Return the line that `fly` prints for a bad flight, empty for another."""
    with contextlib.redirect_stdout(io.StringIO()) as printed:
        return "" if fly(swarm, *given) else printed.getvalue().strip()


def flights(rounds: range) -> Iterator[tuple[str, int, str]]:
    """Fly `rounds`; yield the family and seed of each flight, and what is bad."""
    for k in rounds:
        for fly, every in FAMILIES:
            if k % every:
                continue
            seed = k // every
            try:
                bad = fly(seed)
            except Exception as error:  # whatever a flight's code raises is bad
                bad = f"{type(error).__name__}: {error}"
            yield fly.__name__, seed, bad


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
