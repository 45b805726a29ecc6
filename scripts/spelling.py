"""Checks that no file spells a kind of process but the process table and the kind's own folder.

Code that needs to know a kind asks the plan for a column of the table. It looks at all string literals but docstrings.
"""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator
from pathlib import Path

from flockwire.wire.processes import PROCESSES

ROOT = Path(__file__).parents[1]
TABLE = "core/flockwire/wire/processes.py"
HOMONYMS = {  # words that mean something else there
    ("core/flockwire/swarm/model.py", "uav"),  # the name of a drone
    ("core/flockwire/swarm/model.py", "gateway"),  # a table of the swarm file
    ("core/flockwire/swarm/drones.py", "kinematics"),  # an airframe
    ("core/flockwire/swarm/tables.py", "router"),  # a mode of the network
    ("core/flockwire/swarm/reading.py", "leader"),  # a table of the swarm file
    ("cli/flockwire_cli/initial.py", "leader"),
    ("core/flockwire/runtime/configuration.py", "router"),  # Zenoh's own modes
    ("cli/flockwire_cli/attackers.py", "router"),
}
OWN_FOLDERS = {
    **{row.kind: row.core.split(".", maxsplit=1)[0] for row in PROCESSES if row.core},
    **{row.kind: "flockwire_cli" for row in PROCESSES if not row.core},
}


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
            kinds = [kind for kind, folder in OWN_FOLDERS.items() if folder not in file.parts and text == kind]
            if kinds or re.search(r"\buav\d*$", text):
                yield node.lineno, text


def main() -> int:
    """Print each spelling; return 1 when there is one."""
    packages = {path for path in ROOT.glob("*/flockwire*") if path.is_dir()}
    files = {str(file.relative_to(ROOT)): file for package in packages for file in sorted(package.rglob("*.py"))}
    found = [(name, *where) for name, file in files.items() if name != TABLE for where in spellings(file)]
    found = [(name, line, text) for name, line, text in found if (name, text) not in HOMONYMS]
    for name, line, text in found:
        print(f"{name}:{line}: {text!r} spells a kind of process; ask the plan (wire/plan.py) for it")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
