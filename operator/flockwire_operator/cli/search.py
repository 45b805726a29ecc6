"""`flockwire study --search` and `--replay`: looks for the worst flight, and flies one that was found again."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from flockwire_core.swarm.wording import InputError
from flockwire_lab.search import corpus
from flockwire_lab.search.campaign import Entry, conduct
from flockwire_lab.search.corpus import Again, Corpus
from flockwire_lab.search.flight import fly, fly_numbered, worst_of
from flockwire_lab.search.shrinking import shrunk
from flockwire_lab.search.space import Candidate, SearchPlan, Space, usual_space
from flockwire_lab.search.writing import read_case, write_case, write_search
from flockwire_lab.study import workers as study_workers
from flockwire_lab.study.file import load_study
from flockwire_lab.study.ledger import Ledger, is_of
from flockwire_lab.study.variation import Table, rehearse
from flockwire_lab.study.workers import Workers

from flockwire_operator.cli.study import naming, place, read, shown, verdict, write_coverage


def search(
    swarm: Path,
    file: Path | None,
    options: dict[str, object],
    liveness: bool,
    out: Path,
    jobs: int,
    scheduler: str,
    first: bool,
    earlier: Path | None = None,
) -> int:
    """Search (`first`: up to the first violation), write and print what was found.

    `earlier` is the folder of a search whose flights are flown first.

    Returns the exit status: 1 with a violation, or if it was stopped. Raises InputError for bad
    input, before anything is written; OSError if `out` fails.
    """
    table, checked = read(swarm)
    options |= {"mode": "liveness"} if liveness else {}
    plan = load_study(file, options, SearchPlan)
    if not (plan.random or plan.starts or plan.graph):
        plan = load_study(file, usual_space(table, checked, plan.mode) | options, SearchPlan)
    with naming(file or swarm):
        rehearse(plan, table)
        space = Space(plan, table, checked)
    known = Corpus() if earlier is None else _read_corpus(earlier, plan, table, space)
    with place(jobs, scheduler) as workers, Ledger(out, plan, table, Entry) as ledger:
        stopped = _fly(plan, space, ledger, workers, first, known.asked)
        entries = {entry.number: entry for entry in ledger.results if entry.number < plan.runs}
    return _conclude(space, entries, out, stopped, Again.of(known, entries.values()))


def _read_corpus(folder: Path, plan: SearchPlan, table: Table, space: Space) -> Corpus:
    """Return the flights that an earlier search kept in `folder`. Raises InputError."""
    if plan.method != "search":
        raise InputError(f"--corpus = {folder}: method = {plan.method!r} has none; remove one of them")
    known = corpus.read(folder, space.size)
    if not is_of(folder, plan, table):
        print(f"flockwire: --corpus = {folder}: is of another swarm file, so its flights may change", file=sys.stderr)
    return known


def replay(swarm: Path, faults: Path, seed: int | None, duration: float | None, liveness: bool) -> int:
    """Fly a flight of two files again, print what happens and its margins; returns 1 if it violates a property.

    Raises InputError for bad input.
    """
    table, _ = read(swarm)
    judged = fly(read_case(table, faults, seed or 0, duration or 8.0, "liveness" if liveness else "safety"), print)
    if judged.refused:
        raise InputError(f"{faults}: {judged.refused}")
    for name, margin in sorted(judged.margins.items(), key=lambda item: item[1].value):
        print(f"  {name:12}{margin.value:8.3f}  {margin.what} at {margin.at:.2f} s")
    for violation in judged.violations:
        print(f"flockwire: violated: {violation}", file=sys.stderr)
    return bool(judged.violations)


def _fly(
    plan: SearchPlan, space: Space, ledger: Ledger[Entry], workers: Workers, first: bool, known: Sequence[Candidate]
) -> str:
    """Fly what the ledger lacks; returns why it stopped early, or nothing."""
    violating = 0

    def run(advance: Callable[[str], None]) -> None:
        def step(entry: Entry) -> bool:
            nonlocal violating
            violating += bool(entry.judged.violations)
            advance(f"{violating} with a violation")
            return first and violating > 0

        conduct(plan, space, ledger, lambda orders: study_workers.conduct(orders, workers, fly_numbered), step, known)

    return shown(run, plan.runs, 0, "0 with a violation")


def _conclude(space: Space, entries: dict[int, Entry], out: Path, stopped: str, again: Again) -> int:
    """Write the worst flights, shrink the violations, print both; returns the exit status."""
    found = {number: entry.judged for number, entry in entries.items()}
    commands, smallest = dict[str, str](), dict[str, str]()
    print(f"  {'property':12}{'least margin':>13}  flight")
    for name, number in sorted(worst_of(found).items(), key=lambda item: found[item[1]].margins[item[0]].value):
        margin, asked = found[number].margins[name], entries[number].asked
        case = space.case(asked.point, asked.seed)
        commands[name] = write_case(case, out / "worst" / name)
        print(f"  {name:12}{margin.value:13.3f}  {number}: {margin.what} at {margin.at:.2f} s")
        if margin.violated and not stopped:
            smaller, flights = shrunk(case, name, fly)
            smallest[name] = write_case(smaller, out / "found" / name)
            print(f"  the smallest of {flights} flights that violate it: {smallest[name]}", flush=True)
    for line in again.lines():
        print(f"  {line}")
    write_search(found, commands, smallest, again, out)
    print(f"  search: {out / 'search.json'}")
    write_coverage((judged.events for judged in found.values()), out)
    violating = sum(bool(judged.violations) for judged in found.values())
    failed = f"{violating} of {len(found)} flights violate a property" if violating else ""
    return verdict(stopped, failed, f"no violation in {len(found)} flights")
