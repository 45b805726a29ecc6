"""The public Python interface: pages and modules say the same, and the examples of the pages import nothing else."""

import ast
import inspect
import re
import subprocess
import sys
from dataclasses import fields
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PUBLIC = ("flockwire.scripting", "flockwire.law", "flockwire.analysis", "flockwire.testing", "flockwire.env")
NAMES_ON = {
    "flockwire.scripting": "python", "flockwire.law": "own_law", "flockwire.analysis": "python",
    "flockwire.testing": "testing", "flockwire.env": "learning",
}  # fmt: skip
CALLS_ON = {**NAMES_ON, "flockwire.scripting": "scripting"}
CALL = re.compile(r"`(?:await )?(?:flight)?\.?(\w+)\(([^`]*)\)`")
HEAVY = ("numpy", "scipy", "matplotlib", "rich", "typer", "zenoh", "cryptography")
PAGES = sorted(
    (ROOT / "README.md", ROOT / "deploy/README.md", *(ROOT / "docs").glob("*.md")),
    key=lambda page: (page.name == "own_law.md", page),
)


def text_of(page):
    return (ROOT / f"docs/{page}.md").read_text(encoding="utf-8")


def imported(code):
    """Return the modules of flockwire that Python code imports, or imports from."""
    found = set()
    for node in ast.walk(ast.parse(code)):
        if isinstance(node, ast.Import):
            found.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            found.add(node.module or "")
    return {name for name in found if name.partition(".")[0].startswith("flockwire")}


def named(text, name):
    """Return whether a page has `name` as code."""
    return any(re.search(rf"\b{name}\b", code) for code in re.findall(r"`([^`\n]+)`", text))


def classes(module):
    """Return the public classes of a module."""
    public = import_module(module)
    return [one for name in public.__all__ if inspect.isclass(one := getattr(public, name))]


def signature(module, name):
    """Return the parameters of a public function, class, or method of a public class, without self."""
    owners = (import_module(module), *classes(module))
    found = next((getattr(owner, name) for owner in owners if callable(getattr(owner, name, None))), None)
    assert found is not None, f"{module} has no {name}"
    return [one for key, one in inspect.signature(found).parameters.items() if key != "self"]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_the_examples_of_a_page_import_the_public_interface_alone(page):
    for code in re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL):
        assert imported(code) <= {*PUBLIC, "flockwire_agent.paper_law"}  # a built-in law, to build on


def test_there_are_examples_of_each_public_module():
    text = "".join(page.read_text(encoding="utf-8") for page in PAGES)
    code = "".join(re.findall(r"```python\n(.*?)```", text, re.DOTALL))
    assert imported(code) >= set(PUBLIC)


def test_the_page_lists_the_public_modules_and_no_other():
    listed = re.findall(r"^\| `(flockwire\.\w+)` \|", text_of("python"), re.MULTILINE)
    assert sorted(listed) == sorted(PUBLIC)


@pytest.mark.sources  # compiled functions have no signature
@pytest.mark.parametrize("module", PUBLIC)
def test_every_public_name_is_documented(module):
    public, page = import_module(module), text_of(NAMES_ON[module])
    for name in public.__all__:
        assert named(page, name), name
        assert not callable(getattr(public, name)) or getattr(public, name).__doc__, name


@pytest.mark.sources  # compiled functions have no signature
@pytest.mark.parametrize("module", PUBLIC)
def test_each_call_on_a_page_has_the_parameters_of_the_function(module):
    calls = [call for call in CALL.findall(text_of(CALLS_ON[module])) if "." not in call[0]]
    assert calls
    for name, written in calls:
        parameters = signature(module, name)
        given = [part.partition("=")[::2] for part in filter(None, written.split(", "))]
        assert [key for key, _ in given] == [one.name for one in parameters], name
        for (_, default), one in zip(given, parameters, strict=True):
            assert not default or ast.literal_eval(default) == one.default, name


@pytest.mark.parametrize("module", ["flockwire.scripting", "flockwire.law", "flockwire.testing", "flockwire.env"])
def test_all_that_a_public_class_has_is_documented(module):
    page = text_of(CALLS_ON[module])
    for one in classes(module):
        if issubclass(one, Exception | dict | str | int):
            continue
        own = [
            name for name in (*getattr(one, "__annotations__", ()), *vars(one)) if not name.startswith(("_", "model_"))
        ]
        for name in own:
            assert named(page, name), f"{one.__name__}.{name}"


def test_the_members_that_stay_are_there():
    public, text = import_module("flockwire.analysis"), text_of("python")
    rows = re.findall(r"^\| `([A-Z]\w+)` \| (.*) \|$", text, re.MULTILINE)
    assert {name for name, _ in rows} == {one.__name__ for one in classes("flockwire.analysis")} - {"ExportError"}
    for name, row in rows:
        owner = getattr(public, name)
        there = {field.name for field in fields(owner)} | set(dir(owner))
        listed = {re.match(r"\w+", code)[0] for code in re.findall(r"`(\w[^`]*)`", row)}
        assert listed - {"summary", "stamps", "values"} <= there, name
    for name in ("Check", "Errors"):
        assert all(named(dict(rows)[name], field.name) for field in fields(getattr(public, name))), name


def test_a_law_of_your_own_loads_nothing_heavy():
    code = f"import sys, flockwire.law; print(*sys.modules.keys() & set({HEAVY}))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "\n"


def test_the_front_door_names_what_the_public_modules_have():
    flockwire = import_module("flockwire")
    for name in flockwire.__all__:
        found = getattr(flockwire, name)
        assert f"flockwire.{name}" in PUBLIC or any(
            getattr(import_module(module), name, None) is found for module in PUBLIC
        ), name
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        flockwire.nothing  # noqa: B018
