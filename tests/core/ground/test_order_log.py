"""The gateway's log: it numbers all orders, and accepts what takes up only if it was made from its newest number."""

import pytest
from flockwire_core.domain.order import MISSION_VERBS, MOST_VERSIONS, Mission
from flockwire_core.domain.time import SECOND
from flockwire_core.ground.order_log import AHEAD, BELIEVED, UNDECIDED, OrderLog
from flockwire_core.wire.status import Report

NOW = 1_790_000_000 * SECOND
UP = [verb for verb in MISSION_VERBS if verb not in ("hold", "land")]
PILOTS = frozenset({"leader", "uav1"})


def order(verb, giver, number=0, stamp=NOW):
    return Mission(stamp, "world", verb, giver=giver, number=number)


HOLD, LAND = order("hold", 2), order("land", 3)


@pytest.fixture
def log():
    """Return a log after a start."""
    made = OrderLog(PILOTS, NOW)
    assert made.take(order("start", 1), NOW)
    return made


def obeying(mission):
    return Report("hold", mission=mission)


@pytest.mark.parametrize("verb", UP)
@pytest.mark.parametrize("down", [HOLD, LAND])
def test_what_takes_up_without_knowledge_of_a_hold_or_landing_is_rejected(log, down, verb):
    assert log.take(down, NOW)
    assert not log.take(order(verb, 4, number=1), NOW)
    assert (log.order.verb, log.order.number, log.counts) == (down.verb, 2, (("orders rejected", 1),))
    assert log.take(order(verb, 4, number=2), NOW)
    assert (log.order.verb, log.order.number, log.order.downs) == (verb, 3, (down.version,))


def test_of_two_proposals_that_cross_the_first_is_accepted(log):
    assert log.take(order("start", 5, number=1), NOW)
    assert not log.take(order("start", 4, number=1), NOW)
    assert log.order.giver == 5


def test_a_rejected_proposal_is_counted_once_however_often_it_is_repeated(log):
    log.take(LAND, NOW)
    assert not any(log.take(order("start", 4, number=1), NOW) for _ in range(5))
    assert log.counts == (("orders rejected", 1),)


def test_what_is_repeated_has_its_number_already(log):
    assert not log.take(order("start", 1), NOW)
    log.take(LAND, NOW)
    log.take(order("start", 4, number=2), NOW)
    assert not log.take(LAND, NOW)
    assert (log.order.giver, log.order.number) == (4, 3)


def test_a_hold_cancels_no_landing_but_must_be_known(log):
    log.take(LAND, NOW)
    log.take(HOLD, NOW)
    assert (log.order.version, log.order.number) == (LAND.version, 3)
    assert not log.take(order("start", 4, number=2), NOW)
    assert log.take(order("start", 4, number=3), NOW)


def test_a_hold_keeps_the_formation_that_it_interrupts(log):
    log.take(order("formation", 4, number=1)._replace(start=NOW, formation="wide", without=(3,)), NOW)
    log.take(HOLD, NOW)
    assert log.order[2:7] == ("hold", NOW, "wide", None, (3,))


def test_a_proposal_by_a_clock_far_ahead_is_rejected_and_a_landing_is_not(log):
    late = NOW + AHEAD + 1
    assert not log.take(order("start", 4, number=1, stamp=late), NOW)
    assert log.take(order("land", 4, stamp=late), NOW)


def test_the_age_is_that_of_the_newest_order(log):
    assert OrderLog(PILOTS, NOW).age(NOW) == -1.0
    log.take(LAND, NOW + SECOND)
    assert log.age(NOW + 3 * SECOND) == 2.0


def test_however_many_orders_come_little_is_kept(log):
    for giver in range(100):
        log.take(order("land", giver), NOW)
    assert (len(log.order.downs), log.order.number) == (MOST_VERSIONS, 101)


# A gateway that is started again.


def test_the_kept_order_is_in_force_again_when_a_pilot_obeys_it(log):
    again = OrderLog(PILOTS, NOW, log.order)
    assert again.order is None
    assert not again.learn("uav1", obeying(order("start", 9, number=1)), NOW)
    assert again.learn("leader", obeying(log.order), NOW)
    assert again.order == log.order


def test_before_pilots_have_reported_nothing_takes_up(log):
    again = OrderLog(PILOTS, NOW, log.order)
    assert not again.take(order("start", 9), NOW)
    for pilot in PILOTS:
        again.learn(pilot, Report("ready"), NOW)
    assert again.take(order("start", 9), NOW)
    assert again.order.number == log.order.number + 1
    late = OrderLog(PILOTS, NOW, log.order)
    assert late.take(order("start", 9), NOW + UNDECIDED)


def test_a_hold_or_landing_is_numbered_at_once(log):
    again = OrderLog(PILOTS, NOW, log.order)
    assert again.take(LAND, NOW)
    assert again.order.number == 2
    assert not again.learn("leader", obeying(log.order), NOW)
    assert again.order.verb == "land"


def test_what_was_made_from_an_older_number_is_rejected_by_a_gateway_without_an_order():
    again = OrderLog(PILOTS, NOW, order("land", 3, number=7))
    again.learn("leader", Report("ready"), NOW + UNDECIDED)
    assert not again.take(order("start", 9, number=6), NOW + UNDECIDED)
    assert again.take(order("start", 9, number=7), NOW + UNDECIDED)


def test_a_gateway_that_lost_its_log_goes_on_from_the_pilots_number():
    lost = OrderLog(PILOTS, NOW)
    lost.learn("uav1", obeying(order("start", 1, number=57)), NOW)
    assert lost.order is None
    lost.take(LAND, NOW)
    assert lost.order.number == 58
    late = OrderLog(PILOTS, NOW)
    late.take(LAND, NOW)
    assert late.learn("uav1", obeying(order("start", 1, number=57)), NOW)
    assert (late.order.verb, late.order.number) == ("land", 58)


def test_a_pilot_is_not_believed_far_and_commands_nothing(log):
    for _ in range(3):
        log.learn("uav1", obeying(order("land", 9, number=log.order.number + BELIEVED // 2)), NOW)
    assert (log.order.verb, log.order.giver) == ("start", 1)
    assert log.order.number <= BELIEVED + 3
