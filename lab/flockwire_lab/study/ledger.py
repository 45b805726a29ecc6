"""The folder of a study: its plan (plan.json), and one line for each finished run (runs.jsonl)."""

from __future__ import annotations

import json
from collections.abc import Iterable
from importlib.metadata import version
from pathlib import Path
from typing import Any, Generic, Self, TypeVar

from flockwire_core.locking import EXCLUSIVE, NOW, lock
from flockwire_core.swarm.wording import InputError
from pydantic import TypeAdapter, ValidationError

from flockwire_lab.study.file import Study
from flockwire_lab.study.flight import Result, Task
from flockwire_lab.study.variation import Table

PLAN, RUNS = "plan.json", "runs.jsonl"
Entry = TypeVar("Entry")


class Ledger(Generic[Entry]):
    """Opens the folder `out` for a plan: a new one, or one with earlier runs (`results`), each a dataclass `kind`.

    Raises InputError, without changes, if the folder has other content; OSError if it cannot be written.
    """

    def __init__(self, out: Path, plan: Study, table: Table, kind: type[Entry]) -> None:
        self._lines = TypeAdapter(kind)
        identity = _identity(plan, table)
        there = _read(out / PLAN)
        _refuse_other(out, there, identity)
        out.mkdir(parents=True, exist_ok=True)
        if there is None:
            (out / PLAN).write_text(json.dumps(identity, indent=1) + "\n", encoding="utf-8")
        self._file = (out / RUNS).open("a+b")
        try:
            lock(self._file, EXCLUSIVE | NOW)
            self.results: list[Entry] = self._flown(out)
        except BlockingIOError:
            self._file.close()
            raise InputError(f"--out = {out}: another command works on this study; wait until it ends") from None
        except InputError:
            self._file.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def add(self, result: Entry) -> None:
        """Add a run, on the disk too."""
        self.results.append(result)
        self._file.write(json.dumps(self._lines.dump_python(result)).encode() + b"\n")
        self._file.flush()

    def _flown(self, out: Path) -> list[Entry]:
        """Read the runs; remove a last line that was truncated by a crash."""
        self._file.seek(0)
        content = self._file.read()
        whole = content.rfind(b"\n") + 1
        found = []
        for place, line in enumerate(content[:whole].splitlines(), start=1):
            try:
                found.append(self._lines.validate_json(line))
            except ValidationError:
                raise InputError(f"{out / RUNS}: line {place} is not a run of a study") from None
        self._file.truncate(whole)
        return found


def _refuse_other(out: Path, there: dict[str, Any] | None, identity: dict[str, Any]) -> None:
    """Raise InputError if the folder `out`, where the study `there` is, has other content than the study `identity`."""
    if there is None and out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise InputError(f"--out = {out}: this folder has other content; name a new one")
    if there is not None and there != identity:
        differing = ", ".join(f"its {key} differs" for key in identity if there.get(key) != identity[key])
        how = differing if there else f"its {PLAN} cannot be read"
        raise InputError(f"--out = {out}: there is another study ({how}); name a new folder")


def missing(plan: Study, table: Table, results: Iterable[Result]) -> list[Task]:
    """Return the remaining runs: the first of each grid point, then the second ones, and so on."""
    flown = {(result.point, result.run) for result in results}
    runs = [(point, run) for run in range(plan.runs) for point in range(len(plan.points)) if (point, run) not in flown]
    return [Task(plan, table, point, run) for point, run in runs]


def is_of(folder: Path, plan: Study, table: Table) -> bool:
    """Return whether the study in `folder` is of the swarm file's `table`, whatever else differs from `plan`."""
    return bool((_read(folder / PLAN) or {}).get("swarm") == _identity(plan, table)["swarm"])


def _identity(plan: Study, table: Table) -> dict[str, Any]:
    """Return the identity of a study as JSON has it: everything but the number of runs."""
    content = {
        "flockwire": version("flockwire"),
        "study": plan.model_dump(mode="json", exclude={"runs"}),
        "swarm": {key: value for key, value in table.items() if key != "folder"},
    }
    return dict(json.loads(json.dumps(content, default=str)))


def _read(path: Path) -> dict[str, Any] | None:
    """Return the identity in a file, None if there is no file, {} if it cannot be read."""
    try:
        found = json.loads(path.read_bytes())
    except (FileNotFoundError, NotADirectoryError):
        return None
    except ValueError:
        return {}
    return found if isinstance(found, dict) else {}
