"""Mutants: seeded defects of the safety path, and whether the tests find each.

    .venv-dev/bin/python lab/bench/mutants.py [--only TEXT] [--every N]

mutants.toml has them: what is wrong, a file, and the text that replaces another. Each is put into a copy of the tree,
where the tests of its module run until one fails, then those of its folder, then all that start no process. Ends with
status 1 when a mutant survives, or its text is not there once any more.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import tomllib
from importlib.util import cache_from_source
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]
TABLE = Path(__file__).with_suffix(".toml")
LONGEST = 1800.0  # s; a mutant may loop
PYTEST = (sys.executable, "-m", "pytest", "-x", "-q", "--tb=no", "-p", "no:cacheprovider")


class Mutant(NamedTuple):
    """One defect: in `file`, `before` (which is there once) becomes `after`."""

    defect: str
    file: str
    before: str
    after: str

    def applied(self, text: str) -> str:
        """Return the mutated `text` of the file; raises ValueError if `before` is not there exactly once."""
        if (count := text.count(self.before)) != 1:
            raise ValueError(f"{self.defect}: {self.file} has {self.before!r} {count} times, not once")
        return text.replace(self.before, self.after)

    def tests(self) -> list[list[str]]:
        """Return what finds it, in turn; tests/ mirrors the folders."""
        top, _, *inner = Path(self.file).parts
        near = Path("tests", top, *inner[:-1])
        own = near / f"test_{Path(self.file).stem}.py"
        return [[str(path)] for path in (own, near) if (ROOT / path).exists()] + [
            ["tests", "--ignore=tests/documentation"]
        ]


def mutants() -> list[Mutant]:
    """Return the mutants of the table."""
    return [Mutant(**row) for row in tomllib.loads(TABLE.read_text(encoding="utf-8"))["mutants"]]


def copy_tree(folder: Path) -> dict[str, str]:
    """Copy what git knows into `folder`; return the environment in which its packages come first."""
    listed = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    names = subprocess.run(listed, cwd=ROOT, check=True, capture_output=True, text=True).stdout
    for name in filter(None, names.split("\0")):
        if (ROOT / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, folder / name)
    (folder / ".venv-dev").symlink_to(ROOT / ".venv-dev")
    roots = sorted({str(file.parent.parent) for file in folder.glob("*/flockwire*/__init__.py")})
    return os.environ | {"PYTHONPATH": os.pathsep.join(roots)}


def killer(mutant: Mutant, folder: Path, environment: dict[str, str]) -> str:
    """Return the test that finds `mutant` in the copy in `folder`, empty if none does."""
    file = folder / mutant.file
    text = file.read_text(encoding="utf-8")
    file.write_text(mutant.applied(text), encoding="utf-8")
    Path(cache_from_source(str(file))).unlink(missing_ok=True)  # it is compared by seconds and size only
    try:
        for tests in mutant.tests():
            line = [*PYTEST, "-m", "not integration and not long", *tests]
            done = subprocess.run(
                line, cwd=folder, env=environment, capture_output=True, text=True, timeout=LONGEST, check=False
            )
            if done.returncode == 1:
                return next(line for line in done.stdout.splitlines() if line.startswith(("FAILED", "ERROR")))
            if done.returncode not in {0, 5}:  # 5: no tests
                raise RuntimeError(f"{mutant.defect}: pytest ended with {done.returncode}: {done.stdout[-300:]}")
    except subprocess.TimeoutExpired:
        return "time limit"
    finally:
        file.write_text(text, encoding="utf-8")
        Path(cache_from_source(str(file))).unlink(missing_ok=True)
    return ""


def main() -> int:
    """Run all; returns 1 when one survives."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="", metavar="TEXT", help="those whose defect or file has TEXT")
    parser.add_argument("--every", type=int, default=1, metavar="N", help="each N-th")
    options = parser.parse_args()
    survived = 0
    with tempfile.TemporaryDirectory() as text:
        environment = copy_tree(Path(text))
        for mutant in [one for one in mutants() if options.only in one.defect + one.file][:: options.every]:
            found = killer(mutant, Path(text), environment)
            survived += not found
            print(f"{mutant.file}: {mutant.defect}: {found or 'SURVIVED'}", flush=True)
    return int(survived > 0)


if __name__ == "__main__":
    sys.exit(main())
