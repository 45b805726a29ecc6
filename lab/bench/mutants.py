"""Mutants: seeded defects of the safety path, and what finds each: the suite, drawn flights, any other command.

    .venv-dev/bin/python lab/bench/mutants.py [--columns suite draws] [--out runs/mutants]
    .venv-dev/bin/python lab/bench/mutants.py --columns search search-draws
    python lab/bench/mutants.py --column 'worst=.venv/bin/flockwire study worst.toml --search' --columns worst
    .venv-dev/bin/python lab/bench/mutants.py --only 'ladder: blind landing hovers' --again

mutants/ has them as tables: a name, what is wrong, a file, and the text that replaces another. Each is put into a
copy of the tree, where each column runs until it finds it: exit status 1. `suite` runs the module's own tests, then
those beside them, then all that start no process, then those that do (`--stages`). `draws` flies drawn flights.
`search` and `search-draws` fly `--flights` of a search's space against each mutant: those that add most of what a
search of the unchanged copy found (`--known` flights), near the changed line first, and independent draws.
`search-worse` ends also with a flight of this corpus whose margin is less than any in it was, `search-change` with one
that is not as it was, `draws-change` with such a one of as many recorded draws. `--seconds` ends each of these, and
`draws`, after as much processor time for each mutant. The unchanged copy comes first; a column that finds something
there is not run. Results are kept in OUT/results.jsonl, and a call that was ended continues; `--again` runs the named
ones, or without names those that survived, once more.
"""

from __future__ import annotations

import argparse
import json
import os
import shlex
import shutil
import signal
import sys
from collections.abc import Mapping
from dataclasses import asdict
from functools import partial
from pathlib import Path

from mutant_columns import (
    DRAWS,
    SEARCH,
    STAGES,
    UNCHANGED,
    Column,
    Copy,
    Mutant,
    Result,
    commanded,
    flight,
    judge,
    mutants,
    searched,
    suite,
)


class Results:
    """The results in `file`, one line each; of several of one mutant and column the newest counts."""

    def __init__(self, file: Path) -> None:
        self._file = file
        lines = file.read_text(encoding="utf-8").splitlines(keepends=True) if file.exists() else []
        if lines and not lines[-1].endswith("\n"):  # a call was ended while it wrote
            file.write_text("".join(lines[:-1]), encoding="utf-8")
        rows = [Result(**json.loads(line)) for line in lines if line.endswith("\n")]
        self.newest = {(row.mutant, row.column): row for row in rows}

    def add(self, result: Result) -> None:
        """Keep one."""
        self.newest[result.mutant, result.column] = result
        with self._file.open("a", encoding="utf-8") as log:
            log.write(json.dumps(asdict(result)) + "\n")

    def outcome(self, mutant: str, column: str) -> str:
        """Return what a column did with a mutant, empty if it has not run."""
        row = self.newest.get((mutant, column))
        return row.outcome if row is not None else ""


def figures(results: Results, names: list[str], wanted: list[Mutant]) -> str:
    """Return the figures of each column, and the mutants that no column found."""
    lines = [f"{'column':20}{'mutants':>9}{'killed':>8}{'share':>8}{'processor h':>13}{'kills per h':>13}"]
    for name in names:
        rows = [row for m in wanted if (row := results.newest.get((m.id, name))) is not None]
        killed, hours = sum(row.outcome == "killed" for row in rows), sum(row.processor_s for row in rows) / 3600.0
        share, rate = killed / max(len(rows), 1), killed / hours if hours else 0.0
        lines.append(f"{name:20}{len(rows):>9}{killed:>8}{share:>8.0%}{hours:>13.2f}{rate:>13.0f}")
    lines += [
        f"survived: {mutant.id} ({mutant.file}): {mutant.defect}"
        for mutant in wanted
        if not any(results.outcome(mutant.id, name) == "killed" for name in names)
    ]
    return "\n".join(lines)


def run(options: argparse.Namespace, columns: Mapping[str, Column]) -> bool:
    """Run what is missing of `columns`; return whether a column found each mutant."""
    known = mutants()
    wanted = [mutant for mutant in known if not options.only or mutant.id in options.only][:: options.every]
    if unknown := set(options.only) - {mutant.id for mutant in known}:
        raise SystemExit(f"--only: there is no mutant {', '.join(map(repr, sorted(unknown)))}")
    options.out.mkdir(parents=True, exist_ok=True)
    results = Results(options.out / "results.jsonl")
    copy = Copy((options.out / f"tree{os.getpid()}").resolve())
    try:
        for name, column in columns.items():
            if results.outcome(UNCHANGED, name) != "survived":
                results.add(judge(copy, None, name, column))
            if results.outcome(UNCHANGED, name) != "survived":
                raise SystemExit(f"{name} fails without a mutant: {results.newest[UNCHANGED, name].by}")
        for mutant in wanted:  # in turns: a call that is ended has compared the columns by the same mutants
            for name, column in columns.items():
                was = results.outcome(mutant.id, name)
                wanted_again = options.again and (options.only or was == "survived")
                if was in ("killed", "survived") and not wanted_again:
                    continue
                result = judge(copy, mutant, name, column)
                results.add(result)
                print(f"{result.outcome:9}{result.processor_s:8.1f} s  {name}: {mutant.id}  {result.by}", flush=True)
    finally:
        shutil.rmtree(copy.folder, ignore_errors=True)
    print(figures(results, [*columns], wanted))
    return all(any(results.outcome(m.id, name) == "killed" for name in columns) for m in wanted)


def main() -> int:
    """Run all; returns 1 when a mutant survives every column."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", action="append", default=[], metavar="ID")
    parser.add_argument("--columns", nargs="+", default=["suite", "draws"])
    parser.add_argument("--column", action="append", default=[], metavar="NAME=COMMAND", help="a column of your own")
    parser.add_argument("--stages", nargs="+", default=list(STAGES), choices=STAGES, help="of the suite")
    parser.add_argument("--rounds", type=int, default=1000, help="of drawn flights")
    parser.add_argument("--flights", type=int, default=60, help="of a search's space")
    parser.add_argument("--seconds", type=float, help="processor time of each mutant, but of the suite")
    parser.add_argument("--every", type=int, default=1, help="take one of so many mutants")
    parser.add_argument("--known", type=int, default=1000, help="flights of the search's corpus")
    parser.add_argument("--seed", type=int, default=0, help="of the search and of its draws")
    parser.add_argument("--again", action="store_true", help="run those that survived, or those of --only, once more")
    parser.add_argument("--out", type=Path, default=Path("runs/mutants"))
    options = parser.parse_args()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit("ended"))
    own = {name: commanded(name, shlex.split(command)) for name, _, command in map(_split, options.column)}
    limits = ["--flights", str(options.flights)]
    timed = [] if options.seconds is None else ["--seconds", str(options.seconds)]
    corpus, seeded = (options.out / "corpus").resolve(), partial(searched, seed=options.seed)
    columns: dict[str, Column] = {
        "suite": suite(tuple(options.stages)), "draws": commanded("draws", [*DRAWS, str(options.rounds), *timed]),
        "search": seeded(corpus, options.known, [*limits, *timed]),
        "search-worse": seeded(corpus, options.known, [*limits, *timed], "worse"),
        "search-change": seeded(corpus, options.known, [*limits, *timed], "change"),
        "draws-change": seeded(corpus.with_name("draws"), options.known, [*limits, *timed], "change", "draws"),
        "search-draws": commanded(
            "draws", [*SEARCH, "--method", "draws", "--seed", str(options.seed), *limits, *timed], flight
        ),
        **own,
    }  # fmt: skip
    if unknown := set(options.columns) - set(columns):
        parser.error(f"--columns: there is no column {', '.join(sorted(unknown))}, only {', '.join(columns)}")
    part = f" {'+'.join(options.stages)}" if options.stages != list(STAGES) else ""  # is no result of the whole suite
    return not run(options, {name + part * (name == "suite"): columns[name] for name in options.columns})


def _split(text: str) -> tuple[str, str, str]:
    name, sign, command = text.partition("=")
    if not (name and sign and command):
        raise SystemExit(f"--column: {text!r} is not NAME=COMMAND")
    return name, sign, command


if __name__ == "__main__":
    sys.exit(main())
