"""The fixtures of pytest that flockwire brings along."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from flockwire.testing import VirtualSwarm


@pytest.fixture
def virtual_swarm(request: pytest.FixtureRequest) -> Callable[..., VirtualSwarm]:
    """Open swarm files in virtual time, by their path from the test's folder and a seed."""
    from flockwire.testing import VirtualSwarm  # noqa: PLC0415  (every run of pytest imports this file)

    return lambda file, seed=0: VirtualSwarm(Path(request.path.parent, file), seed)
