"""Flights of the search, or as many draws, in one process until one violates a property: a column of mutants.py.

    .venv/bin/python bench/first_violation.py [--method search] [--flights 150] [--seconds S] [--keep DIR]
    .venv/bin/python bench/first_violation.py --corpus DIR [--changed FILE:LINE]

A leader and two followers, one of them a Tello, under any faults (docs/study.md, "Search"). The first violation ends it
with status 1; so do S seconds of processor time, with status 0. `--keep` keeps the flights in a folder, `--corpus`
flies those of such a folder first, of these the ones that reach the marks near a changed line of the code.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping
from contextlib import nullcontext
from functools import partial
from math import inf
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time

from flockwire.loading import parse_swarm
from flockwire_sim.search import corpus
from flockwire_sim.search.campaign import Entry, conduct
from flockwire_sim.search.changed import near
from flockwire_sim.search.flight import fly_numbered
from flockwire_sim.search.space import SearchPlan, Space, usual_space
from flockwire_sim.study.file import load_study
from flockwire_sim.study.ledger import Ledger
from search import METHODS, five


def ends(entry: Entry, seconds: float = inf) -> bool:
    """Return whether the search ends with a flight, or has used so many s of processor time."""
    return bool(entry.judged.refused or entry.judged.violations) or process_time() >= seconds


def marks_near(changed: str) -> Mapping[str, int]:
    """Return the marks near "FILE:LINE" by weight; none for an empty text."""
    file, _, line = changed.rpartition(":")
    return near(Path(file), int(line)) if file else {}


def main() -> int:
    """Fly; returns 1 with a violation, 2 if a flight could not be flown."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--method", choices=METHODS, default=METHODS[0])
    parser.add_argument("--flights", type=int, default=150)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--keep", type=Path, help="folder that keeps the flights")
    parser.add_argument("--corpus", type=Path, help="folder whose flights are flown first")
    parser.add_argument("--changed", default="", metavar="FILE:LINE", help="near which a flight should come")
    parser.add_argument("--seconds", type=float, default=inf, help="of processor time after which it ends")
    options = parser.parse_args()
    table = five()
    table["drones"], table["graph"] = table["drones"][:3], {"edges": [[0, 1], [1, 2]]}
    table["drones"][2]["airframe"] = "tello"
    swarm = parse_swarm(table, "three drones")
    asked = {"method": options.method, "runs": options.flights, "seed": options.seed}
    plan = load_study(None, usual_space(table, swarm, "safety") | asked, SearchPlan)
    space = Space(plan, table, swarm)
    marks = marks_near(options.changed)
    known = corpus.read(options.corpus, space.size, marks) if options.corpus is not None else ()
    last = partial(ends, seconds=options.seconds)
    kept = TemporaryDirectory() if options.keep is None else nullcontext(options.keep)
    with kept as folder, Ledger(Path(folder), plan, table, Entry) as ledger:
        conduct(plan, space, ledger, partial(map, fly_numbered), last, known)
    entry = min(filter(ends, ledger.results), key=lambda entry: not entry.judged.violations, default=None)
    if entry is None:
        return 0
    print(f"flight {entry.number}: {entry.judged.refused or '; '.join(entry.judged.violations)}")
    return 1 if entry.judged.violations else 2


if __name__ == "__main__":
    sys.exit(main())
