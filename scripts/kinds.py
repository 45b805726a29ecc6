"""Checks that no file spells a kind of process or of airframe but their tables and the kind's own folder.

Code that needs to know a kind asks the plan, or the swarm, for a column of the table. Of processes it looks at all
string literals but docstrings; of airframes, whose names mean nothing else, at every word of every file.
What flies has no identifier of what judges it.
"""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator
from pathlib import Path

from flockwire_core.swarm.airframes import AIRFRAMES
from flockwire_core.wire.processes import PROCESSES

ROOT = Path(__file__).parents[1]
TABLES = ("core/flockwire_core/wire/processes.py", "core/flockwire_core/swarm/airframes.py")
HOMONYMS = {  # words that mean something else there
    ("core/flockwire_core/swarm/model.py", "uav"),  # the name of a drone
    ("core/flockwire_core/swarm/model.py", "gateway"),  # a table of the swarm file
    ("core/flockwire_core/swarm/tables.py", "router"),  # a mode of the network
    ("core/flockwire_core/swarm/gateway.py", "ros"),  # a source of poses
    ("mocap_gateway/flockwire_mocap/core.py", "ros"),
    ("core/flockwire_core/swarm/leader.py", "ros"),  # a kind of leader
    ("operator/flockwire_operator/station/warnings.py", "ros"),  # a source of poses
    ("core/flockwire_core/loading.py", "leader"),
    ("core/flockwire_core/swarm/leader.py", "leader"),
    ("operator/flockwire_operator/station/initial.py", "leader"),
    ("operator/flockwire_operator/station/answers.py", "leader"),
    ("core/flockwire_core/runtime/configuration.py", "router"),  # Zenoh's own modes
    ("core/flockwire_core/runtime/ros_node.py", "router"),
    ("lab/flockwire_lab/probe/attackers.py", "router"),
}

FLY = ("core/flockwire_core", "laws", "agent", "leader", "mocap_gateway", "tello_driver", "recorder")
JUDGED = re.compile(r"(?i)(?<![a-z])(marks|sometimes|faults?|faulty|mutants?|coverage|budgets?)(?![a-z])")


def folder(path: str) -> str:
    """Return the folder of what a table names as "module:name"."""
    return path.split(":", maxsplit=1)[0].split(".")[-2]


OWN_FOLDERS = {row.kind: folder(row.core) if row.core else "cli" for row in PROCESSES}
AIRFRAME_FOLDERS = {
    row.kind: {folder(path) for path in (row.simulated, row.driver) if path}
    for row in AIRFRAMES
    if row.kind not in OWN_FOLDERS
}  # that of simulated airframes is also called as their process


def spellings(file: Path) -> Iterator[tuple[int, str]]:
    """Yield line and text of each literal in `file` that is a kind, or a drone's name put together by hand."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    documentation = {
        id(node.body[0].value)
        for node in ast.walk(tree)
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef)
        and node.body
        and isinstance(node.body[0], ast.Expr)
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in documentation:
            text = node.value
            kinds = [kind for kind, own in OWN_FOLDERS.items() if own not in file.parts and text == kind]
            if kinds or re.search(r"\buav\d*$", text):
                yield node.lineno, text


def airframes(file: Path) -> Iterator[tuple[int, str]]:
    """Yield line and word of each name of an airframe in `file`, in whatever it is: code, comment, text."""
    foreign = [kind for kind, own in AIRFRAME_FOLDERS.items() if own.isdisjoint(file.parts)]
    try:
        lines = file.read_text(encoding="utf-8").split("\n") if foreign else []
    except UnicodeDecodeError:
        return
    for number, line in enumerate(lines, 1):
        yield from ((number, word) for word in re.findall(rf"(?i)\w*(?:{'|'.join(foreign)})\w*", line))


def judging(file: Path) -> Iterator[tuple[int, str]]:
    """Yield line and text of each identifier in `file` that names what a judge of flights has."""
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        for field in ("id", "attr", "name", "arg", "module", "asname"):
            text = getattr(node, field, None)
            if isinstance(text, str) and JUDGED.search(re.sub(r"(?<=[a-z])(?=[A-Z])", "_", text)):
                yield getattr(node, "lineno", 0), text


def main() -> int:
    """Print each spelling; return 1 when there is one."""
    packages = {path for path in ROOT.glob("*/flockwire*") if path.is_dir()}
    files = [file for package in packages for file in sorted(package.rglob("*")) if file.is_file()]
    files = [file for file in files if file.suffix != ".pyc" and str(file.relative_to(ROOT)) not in TABLES]
    code = [(file, *where) for file in files if file.suffix == ".py" for where in spellings(file)]
    found = [(file, line, text) for file, line, text in code if (str(file.relative_to(ROOT)), text) not in HOMONYMS]
    named = [(file, line, text) for file in files for line, text in airframes(file)]
    flying = [file for folder in FLY for file in sorted((ROOT / folder).rglob("*.py"))]
    judged = [(file, line, text) for file in flying for line, text in judging(file)]
    for file, line, text in judged:
        print(f"{file.relative_to(ROOT)}:{line}: {text!r} is of what judges a flight; what flies does not know it")
    for file, line, text in found:
        print(f"{file.relative_to(ROOT)}:{line}: {text!r} spells a kind of process; ask the plan (wire/plan.py) for it")
    for file, line, text in named:
        print(f"{file.relative_to(ROOT)}:{line}: {text!r} names an airframe; ask its row (swarm/airframes.py)")
    return 1 if found or named or judged else 0


if __name__ == "__main__":
    sys.exit(main())
