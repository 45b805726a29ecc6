"""The bench of ways round notes what the law wanted, and judges."""

from __future__ import annotations

import pytest
from flockwire_core.swarm.laws import BUILT_IN
from settling import TELLO
from ways import flown


def test_a_place_that_passes_an_obstacle_does_not_lean_on_the_filter(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(BUILT_IN, "extended", BUILT_IN["extended"])  # which the flight replaces
    result = flown(TELLO, ("crossing", 3))
    assert result.why == []
    assert 0 < result.limited < result.steps
    assert result.leaning < 0.05 * result.steps
    assert (result.conflicts, result.turned) == (0, 0)  # nobody else is near


@pytest.mark.long
def test_what_two_want_at_once_is_counted_as_a_conflict(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(BUILT_IN, "extended", BUILT_IN["extended"])
    result = flown(TELLO, ("swap", 0))
    assert result.why == []
    assert result.conflicts > 0
