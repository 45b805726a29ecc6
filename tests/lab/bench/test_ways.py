"""The bench of ways round notes what the law wanted, and judges."""

from __future__ import annotations

import pytest
from flockwire_core.swarm.laws import BUILT_IN
from settling import TELLO
from ways import flown


def test_a_flight_with_noted_velocities_is_good_and_the_filter_changes_some(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(BUILT_IN, "extended", BUILT_IN["extended"])  # which the flight replaces
    result = flown(TELLO, ("crossing", 3))
    assert result.why == []
    assert 0 < result.changed < result.steps
