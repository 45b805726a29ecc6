"""Puts mutants into a copy of the tree, and runs there what may find them: the columns of mutants.py."""

from __future__ import annotations

import os
import resource
import shutil
import signal
import subprocess
import tomllib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib.util import cache_from_source
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]
TABLES = ROOT / "lab/bench/mutants"
UNCHANGED = "unchanged"  # the name of the copy without a mutant
FOUND, NOTHING = 1, 0  # exit statuses of a command of a column
LONGEST = 3600.0  # s that a command may take
MOST_PROCESSOR = 1500  # s of processor time of one process: a mutant may loop
FAST = ("agent", "leader", "kinematics", "core", "mocap_gateway", "tello_driver", "router")  # folders of tests/
STAGES = ("own", "near", "fast", "flights", "rest", "processes")
OWN = "tests/lab/bench"  # judges the tables, not the tree


class Mutant(NamedTuple):
    """One defect: in `file`, `before` (which is there once) becomes `after`; `model` is the like bug of model/."""

    id: str
    defect: str
    file: str
    before: str
    after: str
    model: str = ""

    def line(self, text: str) -> int:
        """Return the line of `text` of the file that it changes first."""
        return text[: text.index(self.before) + len(self.before) - len(self.before.lstrip())].count("\n") + 1

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
            "flights": ["tests/lab"],
            "rest": ["tests", *others, *done],
            "processes": ["tests", "-m", "integration and not long"],
        }
        for stage in STAGES:
            if stage in stages and of[stage]:
                yield Stage(stage, [*PYTEST, *of[stage]], _failed_test)

    return column


PYTEST = [
    ".venv-dev/bin/python", "-m", "pytest", "-x", "-q", "--tb=no", "-p", "no:cacheprovider", f"--ignore={OWN}",
    "-m", "not integration and not long",
]  # fmt: skip
DRAWS = [".venv-dev/bin/python", "lab/bench/drawn_flights.py", "--rounds"]
SEARCH = [".venv-dev/bin/python", "lab/bench/first_violation.py"]
AGAIN = 60  # flights of a corpus that the unchanged copy flies again


def _failed_test(output: str) -> str:
    """Return the first test that failed; a file that cannot be imported is none."""
    lines = [line for line in output.splitlines() if line.startswith(("FAILED", "ERROR")) and "::" in line]
    return lines[0].split(" - ")[0].partition(" ")[2] if lines else ""


def _last_line(output: str) -> str:
    lines = output.strip().splitlines()
    return lines[-1] if lines else ""


def flight(output: str) -> str:
    """Return the flight that `SEARCH` found; an error of the command is none."""
    line = _last_line(output)
    return line if line.startswith("flight ") else ""


def commanded(name: str, command: list[str], found: Callable[[str], str] = _last_line) -> Column:
    """Return the column of one command, whose last line says what it found."""
    return lambda _: iter([Stage(name, command, found)])


def searched(
    corpus: Path, known: int, limits: list[str], until: str = "violation", method: str = "search", seed: int = 0
) -> Column:
    """Return the column of a search: `known` flights of the unchanged copy are its corpus, kept in a folder.

    There they are flown again, too, which must not end it: `until` is what does (first_violation.py). `method` "draws"
    flies as many draws in their own order instead.
    """
    chosen = [*SEARCH, "--method", method, "--seed", str(seed)]
    again = [*chosen, "--corpus", str(corpus), "--until", until]

    def column(mutant: Mutant | None) -> Iterator[Stage]:
        if mutant is None:
            yield Stage("search", [*chosen, "--keep", str(corpus), "--flights", str(known)], flight)
            if until != "violation":
                yield Stage("search", [*again, "--flights", str(AGAIN)], flight)
            return
        place = f"{mutant.file}:{mutant.line((ROOT / mutant.file).read_text(encoding='utf-8'))}"
        yield Stage("search", [*again, "--changed", place, *limits], flight)

    return column


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
        (folder / ".venv-dev").symlink_to(ROOT / ".venv-dev")
        packages = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["hatch"]["build"]["targets"]["wheel"]
        roots = dict.fromkeys(str(folder / Path(package).parent) for package in packages["packages"])
        self._environment = os.environ | {"PYTHONPATH": os.pathsep.join(roots)}  # before those of .venv-dev

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
            by = stage.found(output) if status == FOUND else "time limit" if status is None else ""
            if by:
                return Result(identity, name, "killed", f"{stage.name}: {by}", spent)
            if status != NOTHING:
                return Result(identity, name, "failed", f"{stage.name}: status {status}: {_last_line(output)}", spent)
    finally:
        take_out()
    return Result(identity, name, "survived", "", spent)
