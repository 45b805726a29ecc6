"""Where a drone can be after a time without poses."""

import pytest
from flockwire.control.airframe.state import AirframeState
from flockwire.domain.motion import Motion
from flockwire.domain.pose import Pose
from flockwire.domain.time import SECOND
from flockwire.parameters import pilot_parameters
from flockwire.pilot.tracked_body import TrackedBody

SEEN_AT = 1_790_000_000 * SECOND
STILL = (0.0, 0.0, 0.0)
HERE = (0.0, 0.0, 1.0)


@pytest.fixture
def body(make_swarm):
    """Return a body that hovered when its pose was used last."""
    body = TrackedBody(pilot_parameters(make_swarm(), 1), AirframeState(0.0, 0.0))
    body.seen, body.seen_at = Motion(HERE, STILL, HERE), SEEN_AT
    return body


def pose(x, after):
    """Return a pose at `x` m, `after` s after the last one that was used."""
    return Pose(SEEN_AT + round(after * SECOND), "world", (x, 0.0, 1.0))


@pytest.mark.parametrize(("x", "reached"), [(0.9, True), (1.0, False), (-0.9, True), (-1.0, False)])
def test_a_wind_of_15_m_s_may_have_moved_it(body, x, reached):
    assert body.reaches(pose(x, 0.5), SECOND // 2) is reached
    assert body.watched is reached  # a pose that it can have is examined


def test_it_coasts_to_its_stopping_point_and_as_far_as_its_driver_obeys_a_frozen_pilot(body):
    body.seen = Motion(HERE, (1.0, 0.0, 0.0), (0.5, 0.0, 1.0))
    body._airframe.command((1.0, 0.0, 0.0), 0.0)
    assert body.reaches(pose(1.6, 0.5), SECOND // 2)
    assert not body.reaches(pose(1.7, 0.5), SECOND // 2)


def test_the_time_counts_from_the_last_pose_that_was_used(body):
    assert body.reaches(pose(3.0, 2.0), SECOND // 2)  # those in between were too old
    assert not body.reaches(pose(3.0, -1.0), SECOND // 2)  # the tracker's clock was set back


def test_a_pilot_that_has_used_no_pose_examines_the_first(body):
    body.seen = None
    assert body.reaches(pose(9.0, 0.5), SECOND // 2)
    assert body.watched
