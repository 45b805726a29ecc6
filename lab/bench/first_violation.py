"""Flights of the search, or as many draws, in one process until one violates a property: a column of mutants.py.

    .venv-dev/bin/python lab/bench/first_violation.py [--method search] [--flights 150] [--seconds S] [--keep DIR]
    python lab/bench/first_violation.py --corpus DIR [--changed FILE:LINE] [--until violation|worse|change]

A leader and two followers, one of them a Tello, under any faults (docs/study.md, "Search"). The first violation ends it
with status 1; so do S seconds of processor time, with status 0. `--keep` keeps the flights in a folder, `--corpus`
flies those of such a folder first, of these the ones that reach the marks near a changed line of the code; with
`--method draws` all in their own order. A flight of the corpus ends it with status 1 too, if it is worse than all of
the corpus were (`--until worse`), or flies otherwise than it did (`--until change`).
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping
from contextlib import nullcontext
from dataclasses import replace
from functools import partial
from math import inf
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time

from flockwire_core.loading import parse_swarm
from flockwire_lab.search import corpus
from flockwire_lab.search.campaign import Entry, conduct
from flockwire_lab.search.changed import near
from flockwire_lab.search.corpus import Corpus
from flockwire_lab.search.flight import fly_numbered
from flockwire_lab.search.space import SearchPlan, Space, usual_space
from flockwire_lab.study.file import load_study
from flockwire_lab.study.ledger import Ledger
from search import METHODS, five

UNTIL = ("violation", "worse", "change")


def found(entry: Entry, known: Corpus, until: str = UNTIL[0]) -> str:
    """Return what a flight shows that ends the search, in words."""
    if entry.judged.violations:
        return "; ".join(entry.judged.violations)
    if until != UNTIL[0] and (worse := known.worse(entry)):
        return "; ".join(worse)
    return "flies otherwise than before" if until == UNTIL[2] and known.changed(entry) else ""


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
    parser.add_argument("--until", choices=UNTIL, default=UNTIL[0], help="what ends it")
    parser.add_argument("--seconds", type=float, default=inf, help="of processor time after which it ends")
    options = parser.parse_args()
    table = five()
    table["drones"], table["graph"] = table["drones"][:3], {"edges": [[0, 1], [1, 2]]}
    table["drones"][2]["airframe"] = "tello"
    swarm = parse_swarm(table, "three drones")
    asked = {"method": options.method, "runs": options.flights, "seed": options.seed}
    plan = load_study(None, usual_space(table, swarm, "safety") | asked, SearchPlan)
    space = Space(plan, table, swarm)
    known = Corpus()
    if options.corpus is not None:
        known = corpus.read(options.corpus, space.size, marks_near(options.changed))
        if options.method == "draws":  # asks for them again, in their own order
            known = replace(known, flights=corpus.flown(options.corpus))
    what: dict[int, str] = {}  # by flight, what ends the search, and why it could not be flown

    def ends(entry: Entry) -> bool:
        if line := found(entry, known, options.until) or entry.judged.refused:
            what[entry.number] = line
        return bool(what) or process_time() >= options.seconds

    kept = TemporaryDirectory() if options.keep is None else nullcontext(options.keep)
    with kept as folder, Ledger(Path(folder), plan, table, Entry) as ledger:
        conduct(plan, space, ledger, partial(map, fly_numbered), ends, known.asked)
    for entry in ledger.results:
        if entry.number in what:
            print(f"flight {entry.number}: {what[entry.number]}")
            return 2 if entry.judged.refused else 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
