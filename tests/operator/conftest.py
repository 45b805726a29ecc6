"""Stations without a gateway: nobody answers who asks for swarm time, so it is known."""

from __future__ import annotations

import pytest
from flockwire_core.process.timekeeping import Timekeeping
from flockwire_core.runtime import swarm_clock


@pytest.fixture(autouse=True)
def _swarm_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(swarm_clock, "timekeeping", lambda plan, identity, _correct: Timekeeping(plan, identity))
