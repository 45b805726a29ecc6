"""A process that lies with good keys, flown: whom it harms, and what notices it."""

from __future__ import annotations

from collections.abc import Callable
from math import dist
from typing import Any

import pytest
from flockwire_core.domain.motion import Leading
from flockwire_core.wire.status import LEFT_OUT

EVERYBODY = {"control.law": "extended", "graph.edges": [[i, j] for j in range(1, 5) for i in range(5) if i != j]}
AT = 4.5


def codes(flown: Any, identity: str) -> set[str]:
    """Return the codes of all reasons that a process reported."""
    return {reason.code for _, status in flown.of("status", identity) for reason in status.report.reasons}


def test_all_that_a_liar_says_is_published_and_only_its_estimate_is_left_out(fly: Callable[..., Any]) -> None:
    lies = (
        {"at": AT, "kind": "false_estimate", "drone": 1, "velocity": [2.0, 0.0, 0.0], "duration": 1.5},
        {"at": AT, "kind": "false_age", "drone": 1, "age": 0.25, "duration": 1.5},
        {"at": AT, "kind": "false_height", "drone": 2, "offset": 0.5, "duration": 1.0},
    )
    flown = fly(EVERYBODY, *lies, duration=6.0)
    (_, lie), (_, truth) = (flown.of("estimate", owner, AT + 1.0, AT + 1.1)[0] for owner in ("uav1", "uav2"))
    assert dist(lie.motion.position, truth.motion.position) == pytest.approx(2.0, abs=0.3)
    assert lie.motion.velocity[0] - truth.motion.velocity[0] == pytest.approx(2.0, abs=0.1)
    assert (lie.stamp - lie.origin, lie.hops, lie.leading) == (250_000_000, 0, Leading.LEADS)
    assert codes(flown, "uav2") == codes(flown, "uav4") == {LEFT_OUT}
    assert codes(flown, "uav1") == set()
    heights = [message.height for _, message in flown.of("telemetry", "uav2", AT - 0.5, AT + 1.4)]
    assert max(heights) - min(heights) == pytest.approx(0.5, abs=0.05)
    assert not flown.outcome.failure
