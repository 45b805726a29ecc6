from flockwire.flight.phases import NEVER, Phase
from flockwire.nanoseconds import BILLION
from flockwire.swarm.tables import Staleness
from flockwire.wire.messages import Estimate, Leading, Pose
from flockwire.wire.status import Report, Status
from flockwire_agent.neighbourhood import Neighbourhood

T = 1_790_000_000 * BILLION
A, B = (1.0, 0.0, 0.0), (0.0, 2.0, 0.0)
LIMITS = Staleness(estimate_drop=0.3, estimates_hold=1.0, leader_silent=1.0)


def fresh(neighbourhood, now):
    """Return (weight, position) of what the neighbours that count sent."""
    return [(heard.weight, heard.motion.position) for heard in neighbourhood.fresh(now)]


def estimate(stamp, position, origin=None, hops=0, leading=Leading.UNKNOWN):
    origin = stamp if origin is None else origin
    return Estimate(stamp, "world", position, A, origin=origin, hops=hops, leading=leading)


def status(stamp, phase):
    return Status(stamp, "world", "leader", Report(phase), 0, 0, 0, 0, 0, 0.0, 0, (), ())


def received():
    """Return a neighbourhood of the leader and uav1 that received both at T; 0.3 s is stale."""
    both = Neighbourhood({0: 2.0, 1: 1.0}, LIMITS)
    both.take_pose(0)(Pose(T, "world", A))
    both.take_estimate(1)(estimate(T, B))
    return both


def test_the_leaders_pose_is_its_estimate_of_itself():
    assert fresh(received(), T) == [(2.0, A), (1.0, B)]


def test_another_neighbours_pose_is_no_estimate():
    both = Neighbourhood({1: 1.0}, LIMITS)
    both.take_pose(1)(Pose(T, "world", A))
    assert fresh(both, T) == []
    assert both.positions() == [A]
    assert both.missing(T) == (1,)


def test_a_stale_neighbour_leaves_and_comes_back():
    both = received()
    later = T + BILLION // 2
    both.take_pose(0)(Pose(later, "world", B))
    assert fresh(both, later) == [(2.0, B)]
    assert both.missing(later) == (1,)
    both.take_estimate(1)(estimate(later, A))
    assert fresh(both, later) == [(2.0, B), (1.0, A)]


def test_old_news_does_not_get_younger_by_being_passed_on():
    one = Neighbourhood({1: 1.0}, LIMITS)
    one.take_estimate(1)(estimate(T, A, origin=T - BILLION))
    assert fresh(one, T) == [(1.0, A)]
    one.take_estimate(1)(estimate(T + 1, A, origin=T - BILLION))
    assert fresh(one, T + 1) == []
    assert one.missing(T + 1) == (1,)


def test_no_estimate_rests_on_news_from_its_own_future():
    one = Neighbourhood({1: 1.0}, LIMITS)
    one.take_estimate(1)(estimate(T, A, origin=T + 60 * BILLION))
    one.fresh(T)
    assert one.origin == T


def test_the_newest_news_is_passed_on_with_one_more_hop():
    two = Neighbourhood({1: 1.0, 2: 1.0}, LIMITS)
    two.take_estimate(1)(estimate(T, A, origin=T - 20, hops=4, leading=Leading.IS_DOWN))
    two.take_estimate(2)(estimate(T, A, origin=T - 10, hops=7, leading=Leading.LEADS))
    two.fresh(T)
    assert (two.origin, two.hops, two.leading) == (T - 10, 8, Leading.LEADS)
    two.take_estimate(1)(estimate(T + 1, A, origin=T - 5, hops=255, leading=Leading.IS_DOWN))
    two.fresh(T + 1)
    assert (two.origin, two.hops, two.leading) == (T - 5, 255, Leading.IS_DOWN)


def test_silence_counts_from_the_newest_news_of_the_leader():
    both = received()
    assert both.silence(T + 2 * BILLION, T) == 2.0
    both.fresh(T + BILLION // 4)
    assert both.silence(T + BILLION, T) == 1.0
    both.take_pose(0)(Pose(T + BILLION // 4, "world", A))
    both.fresh(T + BILLION // 4)
    assert both.silence(T + BILLION, T) == 0.75


def test_who_hears_the_leader_judges_its_health_by_its_own_status():
    both = received()
    both.fresh(T)
    assert both.leading is Leading.UNKNOWN
    for phase, leading in (
        (Phase.GROUNDED, Leading.IS_DOWN), (Phase.TAKEOFF, Leading.LEADS), (Phase.HOLD, Leading.LEADS),
        (Phase.FORMATION, Leading.LEADS), (Phase.LANDING, Leading.IS_DOWN), (Phase.STOPPED, Leading.IS_DOWN),
    ):  # fmt: skip
        both.take_status(status(T, phase))
        both.take_estimate(1)(estimate(T, B, leading=Leading.LEADS))  # not asked: it is further away
        both.fresh(T)
        assert both.leading is leading, phase
    both.take_status(status(T, Phase.FORMATION))
    both.fresh(T + BILLION)
    assert both.leading is Leading.LEADS
    both.fresh(T + BILLION + 1)
    assert both.leading is Leading.IS_DOWN


def test_a_virtual_leader_leads_as_long_as_it_reports():
    one = Neighbourhood({0: 1.0}, LIMITS, virtual=True)
    one.take_status(status(T, Phase.GROUNDED))
    one.fresh(T)
    assert one.leading is Leading.LEADS
    one.fresh(T + BILLION + 1)
    assert one.leading is Leading.IS_DOWN


def test_the_oldest_is_never_received_while_one_is_missing():
    assert received().oldest(T + BILLION) == 1.0
    assert Neighbourhood({0: 1.0, 1: 1.0}, LIMITS).oldest(T) == NEVER
