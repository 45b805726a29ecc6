"""What the gateway's process is given at its start."""

from __future__ import annotations

from collections.abc import Callable
from random import Random
from typing import Any

import pytest
from flockwire_core.domain.time import SECOND
from flockwire_core.process.cores import Start
from flockwire_core.wire.plan import Plan

NOW = 1_790_000_000 * SECOND


@pytest.fixture
def start(make_swarm: Callable[..., Any]) -> Callable[..., Start]:
    """Return the builder of what a process of a swarm with this gateway is given."""

    def make(identity: str = "gateway", changes: dict[str, object] | None = None, **gateway: object) -> Start:
        return Start(Plan(make_swarm({"gateway": gateway, **(changes or {})})), identity, NOW, Random(1))

    return make
