"""Flights of the search, or as many draws, in one process until one violates a property: a column of mutants.py.

    .venv/bin/python bench/first_violation.py [--method search] [--flights 150] [--seed 0] [--keep DIR] [--corpus DIR]

A leader and two followers, one of them a Tello, under any faults (docs/study.md, "Search"). The first violation ends it
with status 1. `--keep` keeps the flights in a folder, `--corpus` flies those of such a folder first.
"""

from __future__ import annotations

import argparse
import sys
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

from flockwire.loading import parse_swarm
from flockwire_sim.search import corpus
from flockwire_sim.search.campaign import Entry, conduct
from flockwire_sim.search.flight import fly_numbered
from flockwire_sim.search.space import SearchPlan, Space, usual_space
from flockwire_sim.study.file import load_study
from flockwire_sim.study.ledger import Ledger
from search import METHODS, five


def ends(entry: Entry) -> bool:
    """Return whether the search ends with a flight."""
    return bool(entry.judged.refused or entry.judged.violations)


def main() -> int:
    """Fly; returns 1 with a violation, 2 if a flight could not be flown."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--method", choices=METHODS, default=METHODS[0])
    parser.add_argument("--flights", type=int, default=150)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--keep", type=Path, help="folder that keeps the flights")
    parser.add_argument("--corpus", type=Path, help="folder whose flights are flown first")
    options = parser.parse_args()
    table = five()
    table["drones"], table["graph"] = table["drones"][:3], {"edges": [[0, 1], [1, 2]]}
    table["drones"][2]["airframe"] = "tello"
    swarm = parse_swarm(table, "three drones")
    asked = {"method": options.method, "runs": options.flights, "seed": options.seed}
    plan = load_study(None, usual_space(table, swarm, "safety") | asked, SearchPlan)
    space = Space(plan, table, swarm)
    known = corpus.read(options.corpus, space.size) if options.corpus is not None else ()
    kept = TemporaryDirectory() if options.keep is None else nullcontext(options.keep)
    with kept as folder, Ledger(Path(folder), plan, table, Entry) as ledger:
        conduct(plan, space, ledger, partial(map, fly_numbered), ends, known)
    entry = min(filter(ends, ledger.results), key=lambda entry: not entry.judged.violations, default=None)
    if entry is None:
        return 0
    print(f"flight {entry.number}: {entry.judged.refused or '; '.join(entry.judged.violations)}")
    return 1 if entry.judged.violations else 2


if __name__ == "__main__":
    sys.exit(main())
