"""What all tests share: one hypothesis profile, a small swarm to vary, the command line, the examples of docs/."""

from __future__ import annotations

import os
import pty
import re
import sys
from collections.abc import Callable, Iterator, Mapping
from copy import deepcopy
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from flockwire_core import loading
from flockwire_core.loading import parse_swarm
from flockwire_core.swarm.model import Swarm
from flockwire_core.wire.plan import Plan
from hypothesis import settings
from xdist.scheduler import LoadScopeScheduling

if TYPE_CHECKING:
    from command_line import CommandLine

settings.register_profile("flockwire", derandomize=True, deadline=None, max_examples=60)
settings.load_profile("flockwire")

STARTS = ((0.0, 0.0), (-0.7, 2.6), (2.9, -0.8), (0.6, -2.3), (-2.8, 0.9))
Changes = Mapping[str, object]
ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
INSTALLED = not Path(loading.__file__).is_relative_to(ROOT / "core")


def group(module: Path) -> str:
    """Return which tests run in one process with those of a module, one after the other: one swarm flies at a time."""
    return "flights" if module.parent.name == "integration" else str(module)


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item], config: pytest.Config) -> None:
    """Let the group that takes longest begin first; an installed wheel has no sources."""
    if INSTALLED:
        left = [item for item in items if item.get_closest_marker("sources")]
        config.hook.pytest_deselected(items=left)
        items[:] = [item for item in items if item not in left]
    items.sort(key=lambda item: group(item.path) != "flights")


class Groups(LoadScopeScheduling):
    """Hands each group of tests to one process of pytest-xdist."""

    def _split_scope(self, nodeid: str) -> str:
        return group(Path(nodeid.partition("::")[0]))


def pytest_xdist_make_scheduler(config: pytest.Config, log: object) -> Groups:
    """Return the scheduler of the tests that run in several processes."""
    return Groups(config, log)


def laid_out(page: str, language: str) -> str:
    """Return the first block of code in `language` on a page of docs/."""
    found = re.search(rf"```{language}\n(.*?)```", (DOCS / f"{page}.md").read_text(encoding="utf-8"), re.DOTALL)
    assert found is not None
    return found[1]


def changed_table(changes: Changes | None = None) -> dict[str, Any]:
    """Return the paper's swarm as a table: a chain of four; `changes` are by dotted key, None takes a key out."""
    table: dict[str, Any] = {
        "name": "flock",
        "control": {"law": "paper"},
        "formation": {"kind": "circle", "radius": 2.0, "rate": 0.5},
        "leader": {"trajectory": {"kind": "constant", "velocity": [0.1, 0.1, 0.0]}},
        "graph": {"edges": [[0, 1], [1, 2], [2, 3], [3, 4]]},
        "drones": [{"id": i, "start": [x, y, 0.0]} for i, (x, y) in enumerate(STARTS)],
    }
    for key, value in (changes or {}).items():
        *path, last = key.split(".")
        inner: Any = table
        for part in path:
            inner = inner[int(part)] if isinstance(inner, list) else inner.setdefault(part, {})
        place = int(last) if isinstance(inner, list) else last
        if value is None:
            del inner[place]
        else:
            inner[place] = deepcopy(value)
    return table


@pytest.fixture(scope="session")
def swarm_table() -> Callable[..., dict[str, Any]]:
    """Return the builder of a small valid swarm's table."""
    return changed_table


@pytest.fixture(scope="session")
def make_swarm() -> Callable[..., Swarm]:
    """Return the builder of a small valid swarm."""
    return lambda changes=None: parse_swarm(changed_table(changes), "test.toml")


@pytest.fixture(scope="session")
def make_plan() -> Callable[..., Plan]:
    """Return the builder of a small valid swarm's plan."""
    return lambda changes=None: Plan(parse_swarm(changed_table(changes), "test.toml"))


@pytest.fixture(scope="session")
def example() -> Callable[[str, str], str]:
    """Return the reader of the first block of code of a language on a page of docs/."""
    return laid_out


@pytest.fixture
def documented_law(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> str:
    """Make the law of docs/own_law.md importable, here and in processes begun from here; return its name."""
    installed = tmp_path / "installed"  # not beside a swarm file
    installed.mkdir()
    (installed / "my_law.py").write_text(laid_out("own_law", "python"), encoding="utf-8")
    monkeypatch.syspath_prepend(installed)
    monkeypatch.setenv("PYTHONPATH", str(installed), prepend=os.pathsep)
    monkeypatch.delitem(sys.modules, "my_law", raising=False)
    name = re.search(r'^law = "my_law.py:(\w+)"$', laid_out("own_law", "toml"), re.MULTILINE)
    assert name is not None
    return f"my_law:{name[1]}"


@pytest.fixture
def flockwire(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> CommandLine:
    """Return the `flockwire` command, called in this process."""
    from command_line import CommandLine

    return CommandLine(monkeypatch, capsys)


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[int, int]]:
    """Return both ends of a terminal, whose inner end is the standard input, in whose foreground this process is."""
    ours, theirs = pty.openpty()
    monkeypatch.setattr("os.tcgetpgrp", lambda fd: os.getpgrp() if os.isatty(fd) else -1)
    with os.fdopen(theirs) as stdin:
        monkeypatch.setattr("sys.stdin", stdin)
        yield ours, theirs
