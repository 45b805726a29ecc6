"""Where the body of a flying drone can be, and how fast it can turn."""

from math import cos, radians, sin

import pytest
from flockwire_core.control.airframe.state import AirframeState
from flockwire_core.domain.pose import LEVEL, Pose
from flockwire_core.domain.time import SECOND
from flockwire_core.parameters import pilot_parameters
from flockwire_core.pilot.pilot import NO_TELEMETRY
from flockwire_core.pilot.tracked_body import OUTLIER, TrackedBody
from flockwire_core.wire.phase import Phase

SEEN_AT = 1_790_000_000 * SECOND
HERE = (0.0, 0.0, 1.0)
FRAME = SECOND // 100


@pytest.fixture
def body(make_swarm):
    """Return a body that hovered when its pose was used last."""
    body = TrackedBody(pilot_parameters(make_swarm(), 1), AirframeState(0.0, 0.0), SEEN_AT)
    assert body.take(Pose(SEEN_AT, "world", HERE), Phase.HOLD)
    return body


def pose(x, after, degrees=0.0, y=0.0, z=1.0):
    """Return a pose at `x` m, `after` s after the last one that was used."""
    half = radians(degrees) / 2.0
    return Pose(SEEN_AT + round(after * SECOND), "world", (x, y, z), (0.0, 0.0, sin(half), cos(half)))


@pytest.mark.parametrize(("x", "reached"), [(0.9, True), (1.0, False), (-0.9, True), (-1.0, False)])
def test_a_wind_of_15_m_s_may_have_moved_it(body, x, reached):
    assert body.take(pose(x, 0.5), Phase.FORMATION) is reached


def test_it_coasts_to_its_stopping_point_and_as_far_as_its_driver_obeys_a_frozen_pilot(body):
    body.way = (0.5, 0.0, 0.0)
    body._airframe.command((1.0, 0.0, 0.0), 0.0)
    assert not body.take(pose(1.8, 0.5), Phase.HOLD)
    assert body.take(pose(1.7, 0.5), Phase.HOLD)


def test_it_is_on_its_way_and_not_behind_it(body):
    """Of two close drones that exchange their names, the fast one must not take the other's place for its own."""
    body.way = (0.5, 0.0, 0.0)
    assert not body.take(pose(-0.3, 0.01), Phase.FORMATION)
    assert not body.take(pose(0.2, 0.01, y=0.3), Phase.FORMATION)
    assert body.take(pose(0.6, 0.01), Phase.FORMATION)


def test_the_time_counts_from_the_last_pose_that_was_used(body):
    assert body.take(pose(3.0, 2.0), Phase.HOLD)  # those in between were too old
    assert not body.take(pose(6.1, 1.0), Phase.HOLD)  # the tracker's clock was set back


@pytest.mark.parametrize(
    "place", [(0.0, 0.0, 0.0), (9999.99, 9999.99, 9999.99), (1.5, 0.0, 1.0)], ids=["origin", "far", "moved by 1.5 m"]
)
def test_a_place_that_it_cannot_have_reached_is_never_confirmed(body, place):
    x, y, z = place
    for k in range(1, 600):
        assert not body.take(pose(x, 0.01 * k, y=y, z=z), Phase.FORMATION)
    assert body.why.startswith("jumped by")
    assert not body.take(pose(0.0, 6.0), Phase.LANDING)  # nor does it come back by poses that were wrong
    body.look(None, NO_TELEMETRY, Phase.GROUNDED, SEEN_AT + 7 * SECOND)
    assert body.why == ""
    assert body.take(pose(5.0, 7.0), Phase.GROUNDED)  # a person carries it


def test_one_outlier_is_left_out(body):
    for k in range(1, 200):
        outlier = k % 20 == 0
        assert body.take(pose(5.0 if outlier else 0.0, 0.01 * k), Phase.FORMATION) is not outlier
    assert (body.why, body.refused) == ("", 9)


@pytest.mark.parametrize(("degrees", "turns"), [(20.0, True), (40.0, False), (90.0, False), (180.0, False)])
def test_it_turns_no_faster_than_an_airframe_can(body, degrees, turns):
    assert body.take(pose(0.0, 0.01, degrees), Phase.FORMATION) is turns
    for k in range(2, 2 + OUTLIER // FRAME):
        body.take(pose(0.0, 0.01 * k, degrees), Phase.FORMATION)
    assert bool(body.why) is (degrees >= 90.0)
    assert body.why in ("", f"turned by {degrees:.0f} degrees")


def test_it_may_turn_round_in_a_second(body):
    for k in range(1, 101):
        assert body.take(pose(0.0, 0.01 * k, 3.6 * k), Phase.FORMATION)


def test_two_signs_of_a_quaternion_are_one_orientation(body):
    x, y, z, w = LEVEL
    assert body.take(Pose(SEEN_AT + FRAME, "world", HERE, (-x, -y, -z, -w)), Phase.FORMATION)


def test_a_pilot_that_has_used_no_pose_takes_the_first(make_swarm):
    body = TrackedBody(pilot_parameters(make_swarm(), 1), AirframeState(0.0, 0.0), SEEN_AT)
    assert body.take(pose(9.0, 0.5), Phase.HOLD)
