"""The safety filter by itself; tests/agent/test_safety_clauses.py flies each of its clauses."""

from math import hypot

import pytest
from flockwire.control.airframe_state import Motion
from flockwire.flight.guard import Guard
from flockwire.nanoseconds import BILLION
from flockwire.wire.messages import Body, BodyKind


def test_a_drone_that_cannot_keep_clear_is_no_faster_all_the_same(make_swarm):
    """A body comes from behind at 5 m/s: no velocity within the limits gets out of its way."""
    swarm = make_swarm({"control.law": "extended"})
    filtered, last = Guard(swarm, 1), (2.9, 0.0, 0.0)
    for step in range(1, 30):
        at = step * BILLION // 100
        x, behind = 0.029 * step, Body(BodyKind.DRONE, (0.021 * step - 1.0, 0.0, 0.0), 0.0)
        motion = Motion((x, 0.0, 1.0), last, (x, 0.0, 1.0))
        last = filtered.velocity((3.0, 0.0, 0.0), motion, (behind,), at, at, last, 0.01, 3.0, False)
        assert hypot(*last) <= filtered.speed + 1e-12
    assert hypot(*last) == pytest.approx(filtered.speed)
