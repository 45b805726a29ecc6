from flockwire.flight.phases import NEVER
from flockwire.nanoseconds import BILLION
from flockwire.wire.messages import Estimate, Pose
from flockwire_agent.neighbourhood import Neighbourhood

T = 1_790_000_000 * BILLION
A, B = (1.0, 0.0, 0.0), (0.0, 2.0, 0.0)


def said(neighbourhood, now):
    """Return (weight, position) of what the fresh neighbours said."""
    return [(heard.weight, heard.motion.position) for heard in neighbourhood.heard(now)]


def heard():
    """Return a neighbourhood of the leader and uav1 that heard both at T; 0.3 s is stale."""
    both = Neighbourhood({0: 2.0, 1: 1.0}, 0.3)
    both.hear_pose(0)(Pose(T, "world", A))
    both.hear_estimate(1)(Estimate(T, "world", B, A))
    return both


def test_the_leaders_pose_is_its_estimate_of_itself():
    assert said(heard(), T) == [(2.0, A), (1.0, B)]


def test_another_neighbours_pose_is_no_estimate():
    both = Neighbourhood({1: 1.0}, 0.3)
    both.hear_pose(1)(Pose(T, "world", A))
    assert said(both, T) == []
    assert both.positions() == [A]
    assert both.missing(T) == (1,)


def test_a_stale_neighbour_leaves_and_comes_back():
    both = heard()
    later = T + BILLION // 2
    both.hear_pose(0)(Pose(later, "world", B))
    assert said(both, later) == [(2.0, B)]
    assert both.missing(later) == (1,)
    both.hear_estimate(1)(Estimate(later, "world", A, A))
    assert said(both, later) == [(2.0, B), (1.0, A)]


def test_silence_counts_from_the_last_time_anybody_was_fresh():
    both = heard()
    assert both.silence(T + 2 * BILLION, T) == 2.0
    both.heard(T + BILLION // 4)
    assert both.silence(T + BILLION, T) == 0.75


def test_the_oldest_is_never_heard_while_one_is_missing():
    assert heard().oldest(T + BILLION) == 1.0
    assert Neighbourhood({0: 1.0, 1: 1.0}, 0.3).oldest(T) == NEVER
