"""Milliseconds for seconds and millimetres for metres are refused, with the unit that is meant."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from flockwire_core.swarm.model import Swarm
from flockwire_core.swarm.outline import Outline

MISTAKEN = {
    "gateway.latency": 8,
    "gateway.noise": 1.0,
    "gateway.vrpn.latency": 8.0,
    "gateway.ros.latency": 8.0,
    "gateway.person_radius": 400,
    "limits.staleness.pose_zero": 100,
    "limits.start_tolerance": 200,
    "limits.clock_offset_bound": 50,
    "avoidance.drone_safety_distance": 400,
    "checks.formation_tail": 100,
    "sim.delay": 5,
    "airframes.slow": {"kind": "kinematics", "lag": 250},
}


@pytest.mark.parametrize("key", MISTAKEN)
def test_a_number_in_a_smaller_unit_is_refused_with_the_unit(make_swarm: Callable[..., Any], key: str) -> None:
    with pytest.raises(ValueError, match=key) as refused:
        make_swarm({key: MISTAKEN[key]})
    line = next(line for line in str(refused.value).splitlines() if key in line)
    assert line.endswith((", in s", ", in m"))


OF_A_PLACE = ("formation.", "formations.", "leader.", "limits.fence.floor", "limits.fence.ceiling", "limits.floor",
              "limits.takeoff_height")  # fmt: skip  # rules compare them with the fence
ANY = ("avoidance.sensing_radius", "airframes.NAME.endurance", "checks.settle_within",
       "obstacles.N.", "tracked_obstacles.N.height")  # fmt: skip  # of any size, or compared with the starts


def test_every_time_and_length_has_an_upper_bound_or_a_rule() -> None:
    outline = Outline(Swarm)
    unbounded = {
        key.text
        for key in outline.entries()
        if key.unit in ("s", "m")
        and (text := outline.takes(key.part)).startswith("a number")
        and " less" not in text
        and " to " not in text
    }
    assert {key for key in unbounded if not key.startswith((*OF_A_PLACE, *ANY))} == set()
