import pytest
from flockwire_core.domain.motion import Estimate, LeaderMotion, Leading
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.pilot.agreement import BELIEVED
from flockwire_core.pilot.neighbourhood import Neighbourhood
from flockwire_core.pilot.phases import NEVER
from flockwire_core.swarm.tables import Staleness
from flockwire_core.wire.codec import decode, encode
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.status import LEFT_OUT, Report, Status

T = 1_790_000_000 * SECOND
A, B = (1.0, 0.0, 0.0), (0.0, 2.0, 0.0)
LIMITS = Staleness()  # 0.3 s drop an estimate, 1 s an origin or the leader's status


def estimate(stamp, position=B, origin=None, hops=1, leading=Leading.LEADS):
    return Estimate(stamp, "world", LeaderMotion(position, A, A), stamp if origin is None else origin, hops, leading)


def status(stamp, phase):
    return Status(stamp, "world", "leader", Report(phase), 0, 0, 0, 0, 0, 0.0, 0, (), ())


def said(neighbourhood, now):
    """Return (weight, position) of what the fresh neighbours published."""
    return [(heard.weight, heard.content.position) for heard in neighbourhood.update(now)]


def both():
    """Return a neighbourhood of the leader and uav1 that received from both at T."""
    found = Neighbourhood({0: 2.0, 1: 1.0}, LIMITS)
    found.take_pose(0)(Pose(T, "world", A))
    found.take_estimate(1)(estimate(T))
    return found


@pytest.fixture
def chained():
    """Return the neighbourhood of a follower whose only in-neighbour is uav1."""
    return Neighbourhood({1: 1.0}, LIMITS)


def test_the_leaders_pose_is_its_estimate_of_itself():
    assert said(both(), T) == [(2.0, A), (1.0, B)]


def test_another_neighbours_pose_is_no_estimate(chained):
    chained.take_pose(1)(Pose(T, "world", A))
    assert said(chained, T) == []
    assert chained.positions() == [A]
    assert chained.missing == (1,)


def test_a_stale_neighbour_leaves_and_comes_back():
    found, later = both(), T + SECOND // 2
    found.take_pose(0)(Pose(later, "world", B))
    assert said(found, later) == [(2.0, B)]
    assert found.missing == (1,)
    found.take_estimate(1)(estimate(later, A))
    assert said(found, later) == [(2.0, B), (1.0, A)]


def test_old_news_does_not_get_younger_by_being_passed_on(chained):
    """uav1 publishes as before, but what it rests on is from T."""
    limit = nanoseconds(LIMITS.estimates_hold)
    for now in range(T, T + 3 * SECOND, SECOND // 10):
        chained.take_estimate(1)(estimate(now, origin=T))
        assert bool(chained.update(now)) == (now <= T + limit)
        assert (chained.missing == ()) == (now <= T + limit)
        assert chained.silence(now, T) == (now - T) / SECOND


def test_news_from_the_future_of_the_estimate_is_as_old_as_the_estimate(chained):
    """A neighbour cannot make its news fresher than the message that carries it."""
    chained.take_estimate(1)(estimate(T, origin=T + 60 * SECOND))
    chained.update(T)
    assert chained.origin == T
    assert chained.silence(T + 2 * SECOND, T) == 2.0


def test_an_estimate_without_an_origin_is_no_news(chained):
    chained.take_estimate(1)(estimate(T, origin=0))
    assert chained.update(T) == []
    assert chained.missing == (1,)
    assert chained.silence(T + SECOND, T) == 1.0


def test_silence_counts_from_the_newest_news_and_before_any_from_the_start(chained):
    assert chained.silence(T + 2 * SECOND, T) == 2.0
    chained.take_estimate(1)(estimate(T + SECOND, origin=T + SECOND // 2))
    chained.update(T + SECOND)
    assert chained.silence(T + SECOND, T) == 0.5


def test_what_is_passed_on_is_the_newest_origin_one_hop_further():
    found = Neighbourhood({1: 1.0, 2: 1.0}, LIMITS)
    found.take_estimate(1)(estimate(T, origin=T - 9, hops=3, leading=Leading.IS_DOWN))
    found.take_estimate(2)(estimate(T, origin=T - 5, hops=6))
    found.update(T)
    assert (found.origin, found.hops, found.leading) == (T - 5, 7, Leading.LEADS)


def test_the_leaders_own_pose_is_no_hop_away():
    found = Neighbourhood({0: 1.0}, LIMITS)
    found.take_pose(0)(Pose(T, "world", A))
    found.update(T)
    assert (found.origin, found.hops) == (T, 1)


def test_news_that_circles_in_a_loop_does_not_win_over_newer_news():
    """uav2 passes on what came from here; uav1 has it from the leader."""
    found = Neighbourhood({1: 1.0, 2: 1.0}, LIMITS)
    for k in range(30):
        now = T + k * SECOND // 10
        found.take_estimate(2)(estimate(now, origin=found.origin or T, hops=found.hops + 1))
        found.update(now)
    assert found.origin == T
    assert found.missing == (1, 2)


def three(**more):
    """Return a neighbourhood that has received A from uav1 and uav3, and 9 m beside it from uav2."""
    found = Neighbourhood(dict.fromkeys((1, 2, 3), 1.0), LIMITS, bound=0.3, **more)
    lie = estimate(T, (10.0, 0.0, 0.0), origin=T, hops=0, leading=Leading.IS_DOWN)
    for j, message in ((1, estimate(T, A, T - 5)), (2, lie), (3, estimate(T, A, T - 7))):
        found.take_estimate(j)(message)
    return found


def test_a_neighbour_that_contradicts_two_others_is_left_out_with_all_that_it_says():
    found = three(closer=frozenset({2}))
    assert said(found, T) == [(1.0, A), (1.0, A)]
    assert (found.origin, found.hops, found.leading) == (T - 5, 2, Leading.LEADS)
    assert found.agreement.count == 1


def test_it_is_reported_once_it_lasts_and_until_it_agrees_again():
    found, later = three(), T + BELIEVED
    found.update(T)
    assert found.agreement.reasons(T) == ()
    (reason,) = found.agreement.reasons(later)
    assert (reason.code, reason.text) == (
        LEFT_OUT,
        "leaves out the estimate of uav2, more than 0.3 m from the others",
    )
    assert found.agreement.reason(later) == ""
    found.take_estimate(2)(estimate(T, A))
    assert len(found.update(T)) == 3
    assert found.agreement.reasons(later) == ()


def test_a_lie_about_the_leaders_pose_is_left_out_even_by_one_witness():
    found = Neighbourhood({0: 1.0, 2: 1.0}, LIMITS, bound=0.3)
    found.take_pose(0)(Pose(T, "world", A))
    found.take_estimate(2)(estimate(T + SECOND // 10, (1.0 + 0.1 * A[0], 0.0, 0.0)))  # A later, at its velocity
    assert len(found.update(T)) == 2
    found.take_estimate(2)(estimate(T, B))
    assert said(found, T) == [(1.0, A)]


def test_two_that_contradict_each_other_are_both_used_and_hold_the_drone_once_it_lasts():
    found, later = Neighbourhood({1: 1.0, 2: 1.0}, LIMITS, bound=0.3), T + BELIEVED
    found.take_estimate(1)(estimate(T, A))
    found.take_estimate(2)(estimate(T, B))
    assert len(found.update(T)) == 2
    assert found.agreement.reason(T) == ""
    assert found.agreement.reason(later) == "uav1 and uav2 disagree about the leader by more than 0.3 m"
    found.take_estimate(1)(estimate(later, A))  # uav2 is silent now
    found.update(later)
    assert found.agreement.reason(later) == ""


def test_without_a_bound_nobody_is_left_out():
    found = Neighbourhood({1: 1.0, 2: 1.0, 3: 1.0}, LIMITS)
    for j, x in ((1, 0.0), (2, 50.0), (3, 0.0)):
        found.take_estimate(j)(estimate(T, (x, 0.0, 0.0)))
    assert len(found.update(T)) == 3


@pytest.mark.parametrize(
    ("closer", "leading"), [((1,), Leading.IS_DOWN), ((1, 2), Leading.IS_DOWN), ((2,), Leading.LEADS)]
)
def test_the_leader_is_down_if_one_that_is_closer_to_it_says_so_whatever_a_younger_one_says(closer, leading):
    found = Neighbourhood({1: 1.0, 2: 1.0}, LIMITS, closer=frozenset(closer))
    found.take_estimate(1)(estimate(T, origin=T - 9, leading=Leading.IS_DOWN))
    found.take_estimate(2)(estimate(T, origin=T, leading=Leading.LEADS))
    found.update(T)
    assert found.leading is leading
    found.take_estimate(1)(estimate(T + 1, origin=T - 8))  # it leads again
    found.take_estimate(2)(estimate(T + 1, origin=T + 1))
    found.update(T + 1)
    assert found.leading is Leading.LEADS


def test_hops_do_not_overflow_what_carries_them(chained):
    chained.take_estimate(1)(estimate(T, hops=255))
    chained.update(T)
    assert chained.hops == 255
    assert decode(Estimate, encode(estimate(T, hops=chained.hops))).hops == 255


@pytest.mark.parametrize(
    ("phase", "leading"),
    [
        (Phase.TAKEOFF, Leading.LEADS), (Phase.HOLD, Leading.LEADS), (Phase.FORMATION, Leading.LEADS),
        (Phase.LANDING, Leading.IS_DOWN), (Phase.GROUNDED, Leading.IS_DOWN), (Phase.READY, Leading.IS_DOWN),
        (Phase.STOPPED, Leading.IS_DOWN), ("anything", Leading.IS_DOWN),
    ],
)  # fmt: skip
def test_the_leader_leads_in_the_air_alone(phase, leading):
    found = both()
    found.take_status(status(T, phase))
    found.update(T)
    assert found.leading is leading


def test_a_leader_that_never_published_a_status_is_unknown_and_a_silent_one_is_down():
    found = both()
    found.update(T + 10 * SECOND)
    assert found.leading is Leading.UNKNOWN
    found.take_status(status(T, Phase.FORMATION))
    silent = nanoseconds(LIMITS.leader_silent)
    found.update(T + silent)
    assert found.leading is Leading.LEADS
    found.update(T + silent + 1)
    assert found.leading is Leading.IS_DOWN


def test_the_leaders_own_status_counts_more_than_what_others_say_of_it():
    found = both()
    found.take_estimate(1)(estimate(T + 1, leading=Leading.LEADS))
    found.take_status(status(T, Phase.LANDING))
    found.update(T + 1)
    assert found.leading is Leading.IS_DOWN


def test_a_virtual_leader_leads_in_whatever_phase_until_it_is_silent():
    found = Neighbourhood({0: 1.0}, LIMITS, "virtual")
    found.take_status(status(T, Phase.READY))
    found.update(T)
    assert found.leading is Leading.LEADS
    found.update(T + 2 * SECOND)
    assert found.leading is Leading.IS_DOWN


def test_a_tracked_leader_leads_while_its_pose_comes_whatever_its_process_reports():
    found = Neighbourhood({0: 1.0}, LIMITS, "tracked")
    found.update(T)
    assert found.leading is Leading.UNKNOWN
    found.take_pose(0)(Pose(T, "world", (0.0, 0.0, 1.2)))
    found.update(T)
    assert found.leading is Leading.LEADS
    found.update(T + 2 * SECOND)
    assert found.leading is Leading.IS_DOWN


def test_the_oldest_is_infinitely_old_while_one_is_missing():
    assert both().oldest(T + SECOND) == 1.0
    assert Neighbourhood({0: 1.0, 1: 1.0}, LIMITS).oldest(T) == NEVER
