import pytest
from flockwire_core.domain.order import Mission
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND
from flockwire_core.wire.keys import MISSION, Key
from flockwire_leader.grounded import TrackedLeader

BEGAN = 1_790_000_000 * SECOND
TRACKED = {"leader.kind": "tracked", "drones.0.start": [0.0, 0.0, 1.2], "drones.0.body": "wand"}


@pytest.fixture
def leader(make_swarm):
    """Return a tracked leader that nothing has reached yet."""
    return TrackedLeader(make_swarm(TRACKED), 0, BEGAN)


def test_it_is_tracked_while_its_pose_comes_and_reports_since_when_it_is_lost(leader):
    assert leader.report(BEGAN).phase == "pose lost"
    assert "has not seen its body 'wand' yet" in leader.report(BEGAN).detail
    leader.receive(Key("pose", "uav0"), Pose(BEGAN, "world", (1.0, 2.0, 1.2)), BEGAN)
    report = leader.report(BEGAN + SECOND // 100)
    assert (report.phase, report.detail, report.position) == ("tracked", "", (1.0, 2.0, 1.2))
    report = leader.report(BEGAN + 2 * SECOND)
    assert (report.phase, report.pose_age) == ("pose lost", 2.0)
    assert "for 2.0 s" in report.detail


def test_it_commands_nothing_whatever_is_ordered_and_may_always_end(leader):
    leader.receive(MISSION, Mission(BEGAN, "world", "takeoff", number=1), BEGAN)
    assert list(leader.step(BEGAN)) == []
    assert leader.report(BEGAN).mission.verb == "takeoff"
    assert leader.may_end(BEGAN)
