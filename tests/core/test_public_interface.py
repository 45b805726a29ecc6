"""The public Python interface: the examples of the pages import nothing else, and docs/python.md names all of it."""

import ast
import re
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PUBLIC = ("flockwire.scripting", "flockwire.law", "flockwire.analysis")
PAGES = sorted(
    (ROOT / "README.md", ROOT / "deploy/README.md", *(ROOT / "docs").glob("*.md")),
    key=lambda page: (page.name == "own_law.md", page),
)


def imported(code):
    """Return the modules of flockwire that Python code imports, or imports from."""
    found = set()
    for node in ast.walk(ast.parse(code)):
        if isinstance(node, ast.Import):
            found.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            found.add(node.module or "")
    return {name for name in found if name.partition(".")[0].startswith("flockwire")}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_the_examples_of_a_page_import_the_public_interface_alone(page):
    for code in re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL):
        assert imported(code) <= set(PUBLIC)


def test_there_are_examples_of_each_public_module():
    text = "".join(page.read_text(encoding="utf-8") for page in PAGES)
    code = "".join(re.findall(r"```python\n(.*?)```", text, re.DOTALL))
    assert imported(code) >= set(PUBLIC)


@pytest.mark.parametrize("module", ["flockwire.scripting", "flockwire.analysis"])
def test_every_public_name_is_documented(module):
    public, page = import_module(module), (ROOT / "docs/python.md").read_text(encoding="utf-8")
    for name in public.__all__:
        assert re.search(rf"`{name}\b", page), name
        assert getattr(public, name).__doc__, name
