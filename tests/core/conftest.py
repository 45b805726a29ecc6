"""Random swarms: graphs with a spanning tree, either sensing, either leader, either mode of the network."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

import pytest
from flockwire_core.security.pki import make_keys
from flockwire_core.wire.plan import Plan
from hypothesis import strategies as st


@st.composite
def variants(draw, most: int = 8, modes: tuple[str, ...] = ("peers", "router")):
    """Draw a swarm of up to `most` followers, as changes of the small swarm."""
    count = draw(st.integers(2, most))
    order = draw(st.permutations(range(1, count + 1)))
    edges = {(draw(st.sampled_from([0, *order[:k]])), i) for k, i in enumerate(order)}
    pairs = st.tuples(st.integers(0, count), st.integers(1, count)).filter(lambda e: e[0] != e[1])
    edges |= draw(st.sets(pairs, max_size=8))
    virtual = draw(st.booleans())
    return {
        "graph.edges": [list(edge) for edge in sorted(edges)],
        "drones": [{"id": i, "start": [1.0 * i, 0.0, 0.0]} for i in range(virtual, count + 1)],
        "avoidance": {"sensing": draw(st.sampled_from(["nearby", "neighbours"]))},
        "leader.kind": "virtual" if virtual else "trajectory",
        "network.mode": draw(st.sampled_from(modes)),
    }


@pytest.fixture(scope="session")
def plans(make_plan) -> st.SearchStrategy[Plan]:
    """Return the strategy of random swarms' plans."""
    return variants().map(make_plan)


@pytest.fixture(scope="session")
def made() -> datetime:
    """Return when the tests' certificates were made."""
    return datetime(2026, 11, 21, 12, 0, tzinfo=UTC)


@pytest.fixture
def keys(make_plan: Callable[..., Plan], tmp_path: Path, made: datetime) -> Path:
    """Return a folder with all keys of the small swarm."""
    make_keys(make_plan(), tmp_path / "keys", made)
    return tmp_path / "keys"
