"""`flockwire study` and `compare-laws`: many virtual flights, a progress bar, a table."""

from __future__ import annotations

import json
import os
import re
import signal
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path

from flockwire_core.extras import require
from flockwire_core.loading import parse_swarm
from flockwire_core.swarm.model import Swarm
from flockwire_core.swarm.wording import InputError
from flockwire_lab import coverage
from flockwire_lab.study.file import Study, load_study
from flockwire_lab.study.findings import Findings, find, write_worst
from flockwire_lab.study.flight import Result, fly
from flockwire_lab.study.ledger import Ledger, missing
from flockwire_lab.study.page import FIGURES, SUCCESS, figure_rows, success_rows, worst_rows, write_study
from flockwire_lab.study.variation import Table, rehearse, swarm_table
from flockwire_lab.study.workers import Workers, WorkersLostError, cluster, conduct, local
from rich import box
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.table import Table as RichTable

COVERAGE = "coverage.txt"
NO_CHANCE = "nothing is random, so all runs of a grid point are equal and their interval has no meaning"


def options_of(runs: int | None, seed: int | None, duration: float | None, starts: str | None) -> dict[str, object]:
    """Return the options as keys of a study file; raises InputError."""
    options: dict[str, object] = {"runs": runs, "seed": seed, "duration": duration}
    if starts is not None:
        if not re.fullmatch(r"\d+(\.\d+)?x\d+(\.\d+)?", starts):
            raise InputError(f"--random-starts = {starts!r}: must be WIDTHxDEPTH in m, like 6x6")
        options["starts"] = {"box": [float(side) for side in starts.split("x")]}
    return {key: value for key, value in options.items() if value is not None}


def study(
    swarm: Path, file: Path | None, options: dict[str, object], out: Path, jobs: int, scheduler: str, pdf: bool
) -> int:
    """Fly the remaining runs, write and print the results; returns the exit status.

    Raises InputError for bad input and ModuleNotFoundError without matplotlib, before anything is written; OSError if
    `out` fails.
    """
    require("matplotlib", "report", "the study")  # said before all flights have flown
    table, checked = read(swarm)
    plan = load_study(file, options, Study)
    with naming(file or swarm):
        rehearse(plan, table)
    with place(jobs, scheduler) as workers, Ledger(out, plan, table, Result) as ledger:
        if plan.runs > 1 and plan.equal_runs(checked):
            print(f"flockwire: warning: runs = {plan.runs}: {NO_CHANCE}", file=sys.stderr)
        stopped = fly_missing(plan, table, ledger, workers)
        findings = find(checked, plan, ledger.results)
    if findings.results:
        write_worst(findings, table, out)
        write_study(findings, checked, out, pdf)
        _print(findings, out)
        write_coverage((result.events for result in ledger.results), out)
    failed = f"{findings.failures} of {len(findings.results)} runs failed" if findings.failures else ""
    return verdict(stopped, failed, f"all {len(findings.results)} runs well")


def compare_laws(swarm: Path, laws: Sequence[str], options: dict[str, object], out: Path, jobs: int) -> int:
    """Fly the remaining runs of a study of `laws`, write and print their table; returns 1 if it was stopped.

    Raises InputError for bad input, OSError if `out` fails.
    """
    from flockwire_lab.study.law_table import CAPTION, rows, text, write  # noqa: PLC0415  (matplotlib)

    table, _ = read(swarm)
    plan = load_study(None, options | {"grid": {"control": [_control(table, law) for law in laws]}}, Study)
    with naming(swarm):
        rehearse(plan, table)
    with place(jobs, "") as workers, Ledger(out, plan, table, Result) as ledger:
        stopped = fly_missing(plan, table, ledger, workers)
        found = rows(plan, ledger.results)
    print(f"{text(found)}\n\n{CAPTION}")
    print(f"flockwire: {', '.join(map(str, write(found, out)))}" + (f"; {stopped}" if stopped else ""))
    return 1 if stopped else 0


def _control(table: Table, text: str) -> dict[str, object]:
    """Return the table [control] for `LAW` or `LAW,PARAMETER=NUMBER,…`; the file's own law keeps its parameters."""
    law, *given = text.split(",")
    control = dict(table.get("control", {}))
    if law != control.get("law"):
        control.pop("parameters", None)
        control.pop("information", None)
    parameters = dict(control.get("parameters", {}))
    for one in given:
        name, _, value = one.partition("=")
        try:
            parameters[name.strip()] = json.loads(value)
        except ValueError:
            raise InputError(f"LAW = {text!r}: must be LAW or LAW,PARAMETER=NUMBER, as consensus,gain=0.5") from None
    return control | {"law": law} | ({"parameters": parameters} if parameters else {})


def read(swarm: Path) -> tuple[Table, Swarm]:
    """Return the content of a swarm file, and the swarm. Raises SwarmFileError."""
    table = swarm_table(swarm)
    return table, parse_swarm(table, str(swarm))


@contextmanager
def naming(file: Path) -> Iterator[None]:
    """Put the name of `file` before each line of an InputError."""
    try:
        yield
    except InputError as error:
        raise InputError("\n".join(f"{file}: {line}" for line in str(error).split("\n"))) from None


def place(jobs: int, scheduler: str) -> AbstractContextManager[Workers]:
    """Return the workers: those of the Dask cluster at the address `scheduler`, or `jobs` processes (0: all cores)."""
    return cluster(scheduler) if scheduler else local(jobs or os.cpu_count() or 1)


def write_coverage(flights: Iterable[Mapping[str, int]], out: Path) -> None:
    """Write how many of the flights had each event. Raises OSError."""
    (out / COVERAGE).write_text("\n".join(coverage.table(flights)) + "\n", encoding="utf-8")
    print(f"  what they showed: {out / COVERAGE}")


def fly_missing(plan: Study, table: Table, ledger: Ledger[Result], workers: Workers) -> str:
    """Fly the runs that the ledger lacks; returns why it stopped early, or nothing."""
    tasks, runs = missing(plan, table, ledger.results), plan.runs * len(plan.points)
    failures = sum(not r.ok for r in ledger.results if r.run < plan.runs)

    def run(advance: Callable[[str], None]) -> None:
        """Fly, keep each result, and say how many failed."""
        nonlocal failures
        for result in conduct(tasks, workers, fly):
            ledger.add(result)
            failures += not result.ok
            advance(f"{failures} failed")

    return shown(run, runs, runs - len(tasks), f"{failures} failed")


def shown(run: Callable[[Callable[[str], None]], None], total: int, done: int, text: str) -> str:
    """Call `run` with a bar, of which `done` of `total` flights are done; returns why it stopped early, or nothing.

    `run` calls its argument with the bar's new text after each flight.
    """
    columns = (BarColumn(None), MofNCompleteColumn(), TextColumn("{task.description}"), TimeElapsedColumn(),
               TimeRemainingColumn())  # fmt: skip
    try:
        with _terminable(), Progress(*columns, console=Console(stderr=True)) as progress:
            bar = progress.add_task(text, total=total, completed=done)
            run(lambda text: progress.update(bar, advance=1, description=text))
    except KeyboardInterrupt:
        return "stopped"
    except WorkersLostError as error:
        return str(error)
    return ""


@contextmanager
def _terminable() -> Iterator[None]:
    """Let SIGTERM end the study like Ctrl-C, with all finished runs kept."""
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _print(findings: Findings, out: Path) -> None:
    console = Console(width=None if sys.stdout.isatty() else 160)
    print(f"{findings.swarm}: {len(findings.results)} virtual flights")
    for heads, rows in ((SUCCESS, success_rows(findings)), (FIGURES, figure_rows(findings))):
        table = RichTable(*heads, box=box.SIMPLE_HEAD)
        for row in rows:
            table.add_row(*row)
        console.print(table)
    print("  the worst runs:")
    for seed, point, verdict, _ in worst_rows(findings):
        print(f"  {seed}  {point}: {verdict}")
    if command := findings.again(findings.worst[0]).get("command"):
        print(f"  to repeat the worst: {command.replace('worst/', f'{out}/worst/')}")
    print(f"  study: {out / 'study.html'}")


def verdict(stopped: str, failed: str, well: str) -> int:
    """Print why it `stopped` early, else what `failed`, else that all is `well`; returns the exit status."""
    bad = f"{stopped}; the same command continues" if stopped else failed
    print(f"flockwire: {bad or well}", file=sys.stderr if bad else sys.stdout)
    return 1 if bad else 0
