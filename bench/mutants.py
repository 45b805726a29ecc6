"""Mutants: seeded defects of the safety path, and what finds each: the suite, drawn flights, any other command.

    .venv/bin/python bench/mutants.py [--columns suite draws] [--out runs/mutants]
    .venv/bin/python bench/mutants.py --column 'search=.venv/bin/flockwire study worst.toml --search' --columns search
    .venv/bin/python bench/mutants.py --only 'ladder: blind landing hovers' --again

bench/mutants/ has them as tables: a name, what is wrong, a file, and the text that replaces another. Each is put into a
copy of the tree, where each column runs until it finds it: exit status 1. `suite` runs the module's own tests, then
those beside them, then all that start no process, then those that do (`--stages`). `draws` flies drawn flights. The
unchanged copy comes first; a column that finds something there is not run. Results are kept in OUT/results.jsonl, and
a call that was ended continues; `--again` runs the named ones, or without names those that survived, once more.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import shlex
import shutil
import signal
import subprocess
import sys
import tomllib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass
from importlib.util import cache_from_source
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
TABLES = ROOT / "bench/mutants"
UNCHANGED = "unchanged"  # the name of the copy without a mutant
FOUND, NOTHING = 1, 0  # exit statuses of a command of a column
LONGEST = 3600.0  # s that a command may take
MOST_PROCESSOR = 1500  # s of processor time of one process: a mutant may loop
FAST = ("agent", "leader", "kinematics", "core", "mocap_gateway", "tello_driver", "router")  # folders of tests/
STAGES = ("own", "near", "fast", "flights", "rest", "processes")
OWN = "tests/bench"  # judges the tables, not the tree


class Mutant(NamedTuple):
    """One defect: in `file`, `before` (which is there once) becomes `after`; `model` is the like bug of model/."""

    id: str
    defect: str
    file: str
    before: str
    after: str
    model: str = ""

    def applied(self, text: str) -> str:
        """Return the mutated `text` of the file; raises ValueError if `before` is not there exactly once."""
        if (count := text.count(self.before)) != 1:
            raise ValueError(f"{self.id}: {self.file} has {self.before!r} {count} times, not once")
        return text.replace(self.before, self.after)


@dataclass(frozen=True)
class Result:
    """What one column did with one mutant: "killed", "survived", or "failed" if a command could not run."""

    mutant: str
    column: str
    outcome: str
    by: str  # what found it
    processor_s: float


class Stage(NamedTuple):
    """One command of a column, and the reader of what it found from its output."""

    name: str
    command: list[str]
    found: Callable[[str], str]


Column = Callable[[Mutant | None], Iterator[Stage]]


def mutants() -> tuple[Mutant, ...]:
    """Return the mutants of all tables."""
    return tuple(
        Mutant(**row)
        for table in sorted(TABLES.glob("*.toml"))
        for row in tomllib.loads(table.read_text(encoding="utf-8"))["mutants"]
    )


def near(file: str) -> Path:
    """Return the folder of the tests beside the module `file`: tests/ mirrors the folders."""
    top, _, *inner = Path(file).parts
    return Path("tests", top, *inner[:-1]) if top == "core" else Path("tests", top)


def own(file: str) -> list[str]:
    """Return the tests with the name of the module `file`; those of the library may stand beside who uses it."""
    folders = [near(file), *(Path("tests", name) for name in FAST if file.startswith("core/"))]
    name = f"test_{Path(file).stem}.py"
    return [str(path) for folder in dict.fromkeys(folders) if (ROOT / (path := folder / name)).is_file()]


def suite(stages: tuple[str, ...]) -> Column:
    """Return the column of the suite; `stages` of STAGES."""

    def column(mutant: Mutant | None) -> Iterator[Stage]:
        folder, first = (near(mutant.file), own(mutant.file)) if mutant is not None else (Path("nowhere"), [])
        done = [f"--ignore={folder}"]
        fast = [f"tests/{name}" for name in FAST if Path("tests", name) != folder]
        others = [f"--ignore=tests/{name}" for name in (*FAST, "sim", "integration")]
        of = {
            "own": first,
            "near": [str(folder), *(f"--ignore={file}" for file in first)] if mutant is not None else [],
            "fast": [*fast, *done],
            "flights": ["tests/sim"],
            "rest": ["tests", *others, *done],
            "processes": ["tests", "-m", "integration and not long"],
        }
        for stage in STAGES:
            if stage in stages and of[stage]:
                yield Stage(stage, [*PYTEST, *of[stage]], _failed_test)

    return column


PYTEST = [
    ".venv/bin/python", "-m", "pytest", "-x", "-q", "--tb=no", "-p", "no:cacheprovider", f"--ignore={OWN}",
    "-m", "not integration and not long",
]  # fmt: skip
DRAWS = [".venv/bin/python", "bench/drawn_flights.py", "--rounds"]


def _failed_test(output: str) -> str:
    lines = [line for line in output.splitlines() if line.startswith(("FAILED", "ERROR"))]
    return lines[0].split(" - ")[0].partition(" ")[2] if lines else ""


def _last_line(output: str) -> str:
    lines = output.strip().splitlines()
    return lines[-1] if lines else ""


def commanded(name: str, command: list[str]) -> Column:
    """Return the column of one command, whose last line says what it found."""
    return lambda _: iter([Stage(name, command, _last_line)])


class Copy:
    """A copy of the tree in `folder`, with its environment, into which one mutant at a time is put."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        listed = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
        files = subprocess.run(listed, cwd=ROOT, check=True, capture_output=True, text=True).stdout
        shutil.rmtree(folder, ignore_errors=True)
        for file in filter(None, files.split("\0")):
            if (ROOT / file).is_file():
                (folder / file).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(ROOT / file, folder / file)
        (folder / ".venv").symlink_to(ROOT / ".venv")
        packages = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["hatch"]["build"]["targets"]["wheel"]
        roots = dict.fromkeys(str(folder / Path(package).parent) for package in packages["packages"])
        self._environment = os.environ | {"PYTHONPATH": os.pathsep.join(roots)}  # before those of .venv

    def put(self, mutant: Mutant) -> Callable[[], None]:
        """Put `mutant` in; return what takes it out."""
        path = self.folder / mutant.file
        was = path.read_text(encoding="utf-8")
        self._write(path, mutant.applied(was))
        return lambda: self._write(path, was)

    def _write(self, path: Path, text: str) -> None:
        path.write_text(text, encoding="utf-8")
        Path(cache_from_source(str(path))).unlink(missing_ok=True)  # which is judged by seconds and size

    def run(self, command: list[str]) -> tuple[int | None, str, float]:
        """Run `command`; return its exit status (None: it took too long), its output, its processor time in s."""
        before = _children_s()
        process = subprocess.Popen(
            command, cwd=self.folder, env=self._environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT, text=True, start_new_session=True,
        )  # fmt: skip
        resource.prlimit(process.pid, resource.RLIMIT_CPU, (MOST_PROCESSOR, MOST_PROCESSOR))
        try:
            output, _ = process.communicate(timeout=LONGEST)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            output, _ = process.communicate()
            return None, output, _children_s() - before
        except BaseException:  # the bench is ended: so is what it began
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
            raise
        status = None if process.returncode in (-signal.SIGXCPU, -signal.SIGKILL) else process.returncode
        return status, output, _children_s() - before


def _children_s() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def judge(copy: Copy, mutant: Mutant | None, name: str, column: Column) -> Result:
    """Run the stages of a column against `mutant` (None: the unchanged copy) until one finds it."""
    identity, spent = mutant.id if mutant is not None else UNCHANGED, 0.0
    take_out = copy.put(mutant) if mutant is not None else lambda: None
    try:
        for stage in column(mutant):
            status, output, processor = copy.run(stage.command)
            spent += processor
            if status == FOUND or status is None:
                by = stage.found(output) if status == FOUND else "time limit"
                return Result(identity, name, "killed", f"{stage.name}: {by}", spent)
            if status != NOTHING:
                return Result(identity, name, "failed", f"{stage.name}: status {status}: {_last_line(output)}", spent)
    finally:
        take_out()
    return Result(identity, name, "survived", "", spent)


class Results:
    """The results in `file`, one line each; of several of one mutant and column the newest counts."""

    def __init__(self, file: Path) -> None:
        self._file = file
        lines = file.read_text(encoding="utf-8").splitlines() if file.exists() else []
        rows = [Result(**json.loads(line)) for line in lines if line.endswith("}")]
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
    lines = [f"{'column':10}{'mutants':>9}{'killed':>8}{'share':>8}{'processor h':>13}{'kills per h':>13}"]
    for name in names:
        rows = [row for m in wanted if (row := results.newest.get((m.id, name))) is not None]
        killed, hours = sum(row.outcome == "killed" for row in rows), sum(row.processor_s for row in rows) / 3600.0
        share, rate = killed / max(len(rows), 1), killed / hours if hours else 0.0
        lines.append(f"{name:10}{len(rows):>9}{killed:>8}{share:>8.0%}{hours:>13.2f}{rate:>13.0f}")
    lines += [
        f"survived: {mutant.id} ({mutant.file}): {mutant.defect}"
        for mutant in wanted
        if not any(results.outcome(mutant.id, name) == "killed" for name in names)
    ]
    return "\n".join(lines)


def run(options: argparse.Namespace, columns: Mapping[str, Column]) -> bool:
    """Run what is missing of `columns`; return whether a column found each mutant."""
    known = mutants()
    wanted = [mutant for mutant in known if not options.only or mutant.id in options.only]
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
            for mutant in wanted:
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
    parser.add_argument("--again", action="store_true", help="run those that survived, or those of --only, once more")
    parser.add_argument("--out", type=Path, default=Path("runs/mutants"))
    options = parser.parse_args()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit("ended"))
    own = {name: commanded(name, shlex.split(command)) for name, _, command in map(_split, options.column)}
    columns: dict[str, Column] = {
        "suite": suite(tuple(options.stages)), "draws": commanded("draws", [*DRAWS, str(options.rounds)]), **own,
    }  # fmt: skip
    if unknown := set(options.columns) - set(columns):
        parser.error(f"--columns: there is no column {', '.join(sorted(unknown))}, only {', '.join(columns)}")
    return not run(options, {name: columns[name] for name in options.columns})


def _split(text: str) -> tuple[str, str, str]:
    name, sign, command = text.partition("=")
    if not (name and sign and command):
        raise SystemExit(f"--column: {text!r} is not NAME=COMMAND")
    return name, sign, command


if __name__ == "__main__":
    sys.exit(main())
