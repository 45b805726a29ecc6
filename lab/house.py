"""Prints the size of the house: lines, imports, circles, complexity, constants.

    .venv-dev/bin/python lab/house.py [TREE] [--list]

All is read from the sources as text, so that any checkout can be counted; what is loaded by name (laws) is no import.
`--list` names what stands behind the counts that should be low.
"""

from __future__ import annotations

import argparse
import ast
import re
import tomllib
from collections.abc import Iterable, Iterator
from itertools import combinations
from pathlib import Path
from typing import Any

SUPPORT = ("bench", "model", "lab/bench", "lab/model")  # before and after the move into lab
HIDDEN = ("build", "dist", "runs")  # ignored by git
FLYING = ("agent", "leader", "gateway", "driver", "tello", "recorder")  # rows of the tables of processes and airframes
TOO_COMPLEX = 10
DEFINITION = ast.FunctionDef | ast.AsyncFunctionDef

Modules = dict[str, tuple[Path, ast.Module]]  # file and syntax tree by dotted name
Graph = dict[str, set[str]]


def read_modules(packages: Iterable[Path]) -> Modules:
    """Read every module in the folders `packages`."""
    modules = {}
    for package in packages:
        for file in sorted(package.rglob("*.py")):
            name = ".".join(file.relative_to(package.parent).with_suffix("").parts).removesuffix(".__init__")
            modules[name] = file, ast.parse(file.read_text(encoding="utf-8"))
    return modules


def imports(node: ast.AST, *, typing: bool) -> Iterator[str]:
    """Yield the names that `node` imports, wherever that stands; with `typing` also those for type checkers only."""
    children: list[ast.AST] = list(ast.iter_child_nodes(node))
    if isinstance(node, ast.If) and not typing and "TYPE_CHECKING" in ast.unparse(node.test):
        children = list(node.orelse)
    elif isinstance(node, ast.Import):
        yield from (alias.name for alias in node.names)
    elif isinstance(node, ast.ImportFrom) and node.module:
        yield from (f"{node.module}.{alias.name}" for alias in node.names)
    for child in children:
        yield from imports(child, typing=typing)


def import_graph(modules: Modules, *, typing: bool = False) -> Graph:
    """Return the modules of the house that each module imports."""
    graph: Graph = {}
    for module, (_, tree) in modules.items():
        names = {name if name in modules else name.rpartition(".")[0] for name in imports(tree, typing=typing)}
        graph[module] = (names & modules.keys()) - {module}
    return graph


def reach(graph: Graph, names: Iterable[str], *, parents: bool = True) -> set[str]:
    """Return all that is imported by `names`, with the packages of what is imported if `parents`."""
    found: set[str] = set()
    waiting = list(names)
    while waiting:
        if (name := waiting.pop()) in graph and name not in found:
            found.add(name)
            waiting += graph[name]
            if parents:
                waiting.append(name.rpartition(".")[0])
    return found


def circles(graph: Graph) -> list[str]:
    """Return the strongly connected components of more than one module."""
    reached = {name: reach(graph, graph[name], parents=False) for name in graph}
    found = {frozenset(other for other in reached[name] if name in reached[other]) for name in graph}
    return [", ".join(sorted(circle)) for circle in found if len(circle) > 1]


def upward_arrows(graph: Graph, contracts: list[dict[str, Any]]) -> list[str]:
    """Return the imports that lead to a higher layer of an import contract."""
    arrows = []
    for contract in contracts:
        layers = [re.split(r"\s*[|:]\s*", layer) for layer in contract.get("layers", [])]
        for container in contract.get("containers", [""]):
            rooms = [tuple(f"{container}.{name}".strip(".") for name in layer) for layer in layers]
            for upper, lower in combinations(rooms, 2):
                arrows += [
                    f"{module} -> {name}"
                    for module, names in graph.items()
                    for name in names
                    if f"{module}.".startswith(tuple(f"{room}." for room in lower))
                    and f"{name}.".startswith(tuple(f"{room}." for room in upper))
                ]
    return arrows


def entries(modules: Modules, kinds: Iterable[str]) -> set[str]:
    """Return the modules of the core, runner and driver of the rows `kinds` of the process and airframe tables."""
    found = []
    for table in ("wire.processes", "swarm.airframes"):
        tree = next(tree for name, (_, tree) in modules.items() if name.endswith(table))
        for row in ast.walk(tree):
            if isinstance(row, ast.AnnAssign) and ast.unparse(row.target) == "runner":
                found.append(row.value)  # the default of all rows
            elif isinstance(row, ast.Call) and row.args and getattr(row.args[0], "value", "") in set(kinds):
                found += row.args[3:4]
                found += [keyword.value for keyword in row.keywords if keyword.arg in {"runner", "driver"}]
    texts = [node.value for node in found if isinstance(node, ast.Constant) and isinstance(node.value, str)]
    return {text.partition(":")[0] for text in texts}


def complexity(node: ast.AST) -> int:
    """Return the cyclomatic complexity that `node` adds, without functions within it; it agrees with radon 6.0."""
    own = 0
    match node:
        case ast.FunctionDef() | ast.AsyncFunctionDef() | ast.ClassDef():
            return 0
        case ast.Assert():
            return 1
        case ast.Try():
            own = len(node.handlers) + bool(node.orelse)
        case ast.BoolOp():
            own = len(node.values) - 1
        case ast.If() | ast.IfExp():
            own = 1
        case ast.Match():
            own = sum(getattr(case.pattern, "pattern", False) is not None for case in node.cases)
        case ast.For() | ast.While() | ast.AsyncFor():
            own = 1 + bool(node.orelse)
        case ast.comprehension():
            own = 1 + len(node.ifs)
    return own + sum(complexity(child) for child in ast.iter_child_nodes(node))


def functions(modules: Modules) -> Iterator[tuple[int, str]]:
    """Yield complexity and name of each function, but for those within functions."""
    for module, (_, tree) in modules.items():
        waiting: list[ast.AST] = [*tree.body]
        for node in waiting:
            if isinstance(node, DEFINITION):
                yield 1 + sum(complexity(child) for child in node.body), f"{module}:{node.lineno} {node.name}"
            else:
                waiting += ast.iter_child_nodes(node)


def constants(modules: Modules) -> Iterator[str]:
    """Yield the constants at module level that are numbers, or sums and products with numbers."""
    parts = ast.Constant | ast.BinOp | ast.UnaryOp | ast.operator | ast.unaryop | ast.Name | ast.Load
    for module, (_, tree) in modules.items():
        for node in tree.body:
            if isinstance(node, ast.Assign | ast.AnnAssign) and node.value is not None:
                nodes = list(ast.walk(node.value))
                numbers = [
                    part for part in nodes if isinstance(part, ast.Constant) and type(part.value) in {int, float}
                ]
                if numbers and all(isinstance(part, parts) for part in nodes):
                    yield f"{module}:{node.lineno} {ast.unparse(node)}"


def lines(file: Path) -> int:
    """Return the number of lines of `file`."""
    return len(file.read_text(encoding="utf-8").splitlines())


def words(page: Path) -> int:
    """Return the number of words of `page` that are not generated."""
    text = page.read_text(encoding="utf-8")
    if "<!-- end -->" in text:
        return len(re.sub(r"<!-- made by .*?<!-- end -->", "", text, flags=re.DOTALL).split())
    return 0 if "<!-- made by" in text else len(text.split())


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("tree", type=Path, nargs="?", default=Path(__file__).parents[1])
    parser.add_argument("--list", action="store_true")
    arguments = parser.parse_args()
    root = arguments.tree
    settings = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["tool"]
    packages = [root / name for name in settings["hatch"]["build"]["targets"]["wheel"]["packages"]]
    modules = read_modules(packages)
    scripts = [file for package in packages for file in package.rglob("*.js")]
    support = [
        file for name in SUPPORT for file in (root / name).rglob("*") if file.suffix in {".py", ".rs", ".toml", ".c"}
    ]
    tests = list((root / "tests").rglob("*.py"))
    folders = [
        path.name for path in root.iterdir() if path.is_dir() and path.name[0] not in "._" and path.name not in HIDDEN
    ]
    graph = import_graph(modules)
    rounds = circles(import_graph(modules, typing=True))
    arrows = upward_arrows(import_graph(modules, typing=True), settings["importlinter"]["contracts"])
    difficult = sorted((found for found in functions(modules) if found[0] > TOO_COMPLEX), reverse=True)
    numbers = list(constants(modules))

    def row(name: str, *counts: object) -> None:
        print(f"{name:<58}", *counts)

    product = sum(lines(file) for file, _ in modules.values())
    row("lines of all packages (.py, .js)", product + sum(map(lines, scripts)))
    row("lines of support; of tests", sum(map(lines, support)), sum(map(lines, tests)))
    row("words of the pages in docs, without generated ones", sum(map(words, (root / "docs").rglob("*.md"))))
    row("top-level folders; packages", len(folders), len(packages))
    for name, kinds in (("an agent", FLYING[:1]), ("agent, leader, gateway, Tello driver, recorder", FLYING)):
        static = reach(graph, entries(modules, kinds))
        row(f"imports of {name}: modules, lines", len(static), sum(lines(modules[each][0]) for each in static))
    row("circles of imports; arrows up", len(rounds), len(arrows))
    row(f"functions of complexity > {TOO_COMPLEX}; the highest", len(difficult), max(difficult, default=(0, ""))[0])
    row("numeric constants at module level", len(numbers))
    if arguments.list:
        print(*rounds, *arrows, *(f"{count} {name}" for count, name in difficult), *numbers, sep="\n")


if __name__ == "__main__":
    main()
