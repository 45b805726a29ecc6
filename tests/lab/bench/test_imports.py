"""No benchmark has rotted: all that it imports from the product is there."""

from __future__ import annotations

import ast
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
pytestmark = pytest.mark.sources
SCRIPTS = sorted([*(ROOT / "lab/bench").rglob("*.py"), *(ROOT / "scripts").rglob("*.py")])


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_a_script_imports_what_there_is(script: Path) -> None:
    for node in ast.walk(ast.parse(script.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("flockwire"):
            module = import_module(node.module or "")
            gone = [alias.name for alias in node.names if not hasattr(module, alias.name)]
            gone = [name for name in gone if not _is_module(f"{node.module}.{name}")]
            assert not gone, f"{node.module} has no {gone}"


def _is_module(name: str) -> bool:
    try:
        import_module(name)
    except ModuleNotFoundError:
        return False
    return True
