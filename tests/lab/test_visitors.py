"""Bodies that are in no swarm file: a person walks through the formation, a tracked obstacle stands in it."""

from __future__ import annotations

from collections.abc import Callable
from math import hypot
from typing import Any

import pytest
from flockwire_core.domain.body import BodyKind
from flockwire_core.swarm.model import uav

SAFE = 0.3  # m, the obstacles' safety distance
AT = 5.0  # s after the order to take off


@pytest.mark.parametrize(
    ("changes", "body", "radius"),
    [
        ({}, "Ada", 0.4),
        pytest.param({"tracked_obstacles": [{"body": "cart", "radius": 0.25}]}, "cart", 0.25, marks=pytest.mark.long),
    ],
)
def test_drones_keep_clear_of_what_walks_through_the_formation(
    fly: Callable[..., Any], changes: dict[str, Any], body: str, radius: float
) -> None:
    visitor = {
        "at": AT,
        "kind": "visitor",
        "body": body,
        "start": [-4.0, 0.3, 1.2],
        "velocity": [1.0, 0.0, 0.0],
        "duration": 9.0,
    }
    flown = fly({"control.law": "extended", **changes}, visitor, duration=12.0)
    gaps, seen = [], []
    for i in range(5):
        for t, pose in flown.of("truth", uav(i), AT, AT + 8.9):
            x, y, z = pose.position
            if z > 0.3:
                gaps.append(hypot(x + 4.0 - (t - AT), y - 0.3) - radius)
        for _, message in flown.of("nearby", uav(i), AT + 1.0, AT + 8.0):
            seen += [b for b in message.bodies if b.kind is BodyKind.MOVER]
    assert SAFE <= min(gaps) < 0.6  # it went right through
    assert {b.radius for b in seen} == {radius}
    assert all(b.velocity == pytest.approx((1.0, 0.0, 0.0), abs=1e-6) for b in seen)
    assert flown.outcome.failure == ""
