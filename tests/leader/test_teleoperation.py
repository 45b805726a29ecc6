"""A leader that a person steers: bounded, inside the fence, and still as soon as the link is lost."""

from math import hypot

import pytest
from flockwire_core.domain.airframe import Steer
from flockwire_core.domain.time import SECOND
from flockwire_core.wire.keys import STEERING, Key
from flockwire_core.wire.phase import Phase

TELEOPERATED = {"leader": {"kind": "teleoperated", "speed": 0.5, "acceleration": 1.0}, "control.law": "extended"}


@pytest.fixture
def steered(seat):
    """Return a steered leader in the formation phase, and what steers it for some seconds."""
    leader = seat({**TELEOPERATED, "limits.fence": {"min": [-3.5, -3.5, -0.5], "max": [3.5, 3.5, 3.0]}})
    leader.run(0.1)
    leader.order("takeoff")
    leader.run(2.0)
    leader.order("start")
    leader.run(0.2)
    assert leader.phase is Phase.FORMATION

    def steer(seconds, velocity):
        for _ in range(round(seconds * 20)):
            command = Steer(leader.now, "world", velocity)
            leader.core.receive(Key(STEERING, "uav0"), command, leader.now)
            leader.run(0.05)

    return leader, steer


def test_it_goes_where_it_is_steered_no_faster_and_no_more_suddenly_than_allowed(steered):
    leader, steer = steered
    leader.fastest = leader.jump = 0.0
    steer(2.0, (9.0, 0.0, 0.0))
    assert leader.velocity == pytest.approx((0.5, 0.0, 0.0), abs=0.01)
    assert leader.fastest <= 0.5 + 1e-6
    assert leader.jump <= 0.01 + 1e-6  # 1 m/s^2 in 10 ms


def test_without_a_command_it_stops_within_the_limit_and_keeps_its_place(steered):
    leader, steer = steered
    steer(2.0, (0.5, 0.0, 0.0))
    leader.run(0.2)
    assert leader.velocity[0] == pytest.approx(0.5, abs=0.01)  # the last command still counts
    leader.run(0.25)
    assert hypot(*leader.velocity) < 0.05
    assert leader.detail.startswith("no steering command for 0.")
    place = leader.position
    leader.run(2.0)
    assert leader.position == pytest.approx(place, abs=0.05)
    steer(1.0, (0.0, 0.5, 0.0))
    assert leader.velocity[1] > 0.4


def test_its_guard_keeps_it_inside_the_fence(steered):
    leader, steer = steered
    steer(12.0, (-0.5, 0.0, 0.0))
    assert -3.5 <= leader.position[0] < -3.3


def test_it_stays_before_any_steering(steered):
    leader, _ = steered
    place = leader.position
    leader.run(1.0)
    assert leader.position == pytest.approx(place, abs=0.02)
    assert leader.detail == "no steering command"


def test_a_command_from_before_a_hold_does_not_move_it_after(steered):
    leader, steer = steered
    steer(1.0, (0.5, 0.0, 0.0))
    leader.order("hold")
    leader.run(1.0)
    leader.order("start")
    leader.run(0.1)
    assert leader.core.report(leader.now + SECOND).phase == Phase.FORMATION
    assert hypot(*leader.velocity) < 0.05
