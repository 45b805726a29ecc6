"""The safety filter by itself; tests/agent/test_safety_clauses.py flies each of its clauses."""

from math import hypot

import pytest
from flockwire.control.guard import Guard
from flockwire.domain.body import Body, BodyKind
from flockwire.domain.motion import Motion
from flockwire.domain.time import SECOND
from flockwire.parameters import guard_parameters


def test_a_drone_that_cannot_keep_clear_is_no_faster_anyway(make_swarm):
    """A body comes from behind at 5 m/s: no velocity within the limits gets out of its way."""
    swarm = make_swarm({"control.law": "extended"})
    parameters = guard_parameters(swarm, 1)
    filtered, last = Guard(parameters), (2.9, 0.0, 0.0)
    for step in range(1, 30):
        at = step * SECOND // 100
        x, behind = 0.029 * step, Body(BodyKind.DRONE, (0.021 * step - 1.0, 0.0, 0.0), 0.0)
        motion = Motion((x, 0.0, 1.0), last, (x, 0.0, 1.0))
        bodies = filtered.tracked(motion, (behind,), at)
        last = filtered.velocity((3.0, 0.0, 0.0), motion, bodies, at, at, last, 0.01, 3.0, False)
        assert hypot(*last) <= parameters.fastest + 1e-12
    assert hypot(*last) == pytest.approx(parameters.fastest)


@pytest.mark.parametrize("kind", [BodyKind.OBSTACLE, BodyKind.MOVER])
def test_a_drone_inside_a_grown_body_leaves_slowly_but_flees_a_person(make_swarm, kind):
    swarm = make_swarm({"control.law": "extended"})
    parameters = guard_parameters(swarm, 1)
    filtered, last = Guard(parameters), (0.0, 0.0, 0.0)
    motion = Motion((0.0, 0.0, 1.0), last, (0.0, 0.0, 1.0))
    for step in range(1, 40):
        at = step * SECOND // 100
        body = Body(kind, (0.1, 0.0, 0.0), 1.0)
        last = filtered.velocity((0.0, 0.0, 0.0), motion, (body,), at, at, last, 0.01, 3.0, False)
    assert (hypot(*last) > 2.0) == (kind is BodyKind.MOVER)
    if kind is BodyKind.OBSTACLE:
        assert last == pytest.approx((-swarm.limits.vertical_speed, 0.0, 0.0))
