"""What all tests share: one hypothesis profile and one small swarm to vary."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import pytest
from flockwire.config import Swarm, parse_swarm
from hypothesis import settings

settings.register_profile("flockwire", derandomize=True, deadline=None, max_examples=100)
settings.load_profile("flockwire")

STARTS = ((0.0, 0.0), (-0.7, 2.6), (2.9, -0.8), (0.6, -2.3), (-2.8, 0.9))
Changes = Mapping[str, object]


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
            inner[place] = value
    return table


@pytest.fixture(scope="session")
def swarm_table() -> Callable[..., dict[str, Any]]:
    """Return the builder of a small valid swarm's table."""
    return changed_table


@pytest.fixture(scope="session")
def make_swarm() -> Callable[..., Swarm]:
    """Return the builder of a small valid swarm."""
    return lambda changes=None: parse_swarm(changed_table(changes), "test.toml")
