from itertools import permutations

import pytest
from flockwire_core.domain.order import MISSION_VERBS, Change, Mission
from flockwire_core.domain.time import SECOND
from flockwire_core.pilot.orders import AHEAD, REMEMBERED, Orders, came_down, flown_place, rank, reported_place
from flockwire_core.wire.status import Report
from hypothesis import given
from hypothesis import strategies as st

NOW = 1_790_000_000 * SECOND
UP = [verb for verb in MISSION_VERBS if verb not in ("hold", "land")]


def order(verb, giver, *knows, stamp=NOW):
    return Mission(stamp, "world", verb, giver=giver, knows=tuple(one.version for one in knows))


def after(*given):
    """Return the orders of one who took these in, one after another."""
    orders = Orders()
    for one in given:
        orders.take(one, NOW)
    return orders


START = order("start", 1)
HOLD, LAND = order("hold", 2), order("land", 3)


@pytest.mark.parametrize("verb", UP)
@pytest.mark.parametrize("down", [HOLD, LAND])
def test_what_takes_up_without_knowledge_of_a_hold_or_landing_is_rejected(down, verb):
    orders = after(START, down, order(verb, 4, START))
    assert orders.mission.verb == down.verb
    assert orders.rejected == order(verb, 4).version
    assert orders.counts == (("orders rejected", 1),)


@pytest.mark.parametrize("verb", UP)
@pytest.mark.parametrize("down", [HOLD, LAND])
def test_what_takes_up_and_was_made_from_it_holds(down, verb):
    assert after(START, down, order(verb, 4, START, down)).mission.verb == verb


@pytest.mark.parametrize("verb", UP)
def test_an_order_that_names_another_newest_is_rejected(verb):
    orders = after(START, order("start", 5, START), order(verb, 4, START))
    assert orders.mission.giver == 5
    assert orders.rejected == order(verb, 4).version


def test_a_rejected_order_is_counted_once_however_often_it_is_repeated():
    late = order("start", 4, START)
    assert after(START, LAND, *[late] * 5).counts == (("orders rejected", 1),)


def test_a_landing_that_a_later_start_was_made_from_does_not_come_back():
    again = order("start", 4, START, LAND)
    assert after(START, LAND, again, LAND).mission == again
    assert after(START, again, LAND).mission == again
    assert after(again, LAND).mission == again


def test_a_hold_takes_no_landing_back_but_must_be_known():
    orders = after(START, LAND, HOLD)
    assert orders.mission.verb == "land"
    assert orders.newest == (LAND.version, START.version, HOLD.version)
    orders.take(order("start", 6, START, LAND), NOW)
    assert orders.mission.verb == "land"


@given(
    st.permutations(
        [START, HOLD, LAND, order("start", 6, START), order("formation", 7, START, HOLD), order("hold", 8, LAND)]
    )
)
def test_after_a_landing_nobody_knew_of_all_land_in_whatever_order_things_arrive(arrivals):
    assert after(*arrivals).mission.verb == "land"


def test_of_all_orders_of_arrival_the_same_order_holds():
    again = order("start", 4, START, HOLD)
    found = {after(START, *arrivals, again).mission.verb for arrivals in permutations((HOLD, again, START, HOLD))}
    assert found == {"start"}


def test_who_lands_by_itself_is_not_taken_up_by_what_did_not_know():
    orders = after(START)
    orders.ended()
    assert orders.spent
    orders.take(order("start", 4, START), NOW)
    assert orders.mission == START
    knowing = order("start", 4)._replace(knows=(START.version, came_down(START)))
    orders.take(knowing, NOW)
    assert (orders.mission, orders.spent) == (knowing, False)


def test_after_a_landing_that_was_ordered_there_is_nothing_more_to_know():
    orders = after(START, LAND)
    orders.ended()
    assert came_down(LAND) not in orders.newest


def test_what_takes_up_by_a_clock_far_ahead_is_rejected_and_a_landing_is_not():
    late = NOW + AHEAD + 1
    assert after(order("start", 1, stamp=late)).mission is None
    assert after(order("land", 1, stamp=late)).mission.verb == "land"


def test_the_age_is_that_of_the_newest_order():
    orders = Orders()
    assert orders.age(NOW) == -1.0
    orders.take(START, NOW)
    orders.take(LAND, NOW + SECOND)
    assert orders.age(NOW + 3 * SECOND) == 2.0


def test_however_many_orders_come_little_is_kept():
    orders = Orders()
    for giver in range(3 * REMEMBERED):
        orders.take(order("land", giver), NOW)
    assert len(orders.newest) <= 32
    assert orders.mission.verb == "land"


def test_the_rank_of_no_order_is_the_lowest():
    assert [rank(each) for each in (None, START, HOLD, LAND)] == [-1, 0, 1, 2]


def test_the_place_of_an_auction_is_the_reported_one(make_swarm):
    edges = [[0, 1], [1, 2], [2, 3], [3, 4], [4, 1]]
    row = {"kind": "line", "spacing": 0.9}
    swarm = make_swarm({"graph.edges": edges, "formation.assignment": "auction", "formations": {"row": row}})
    formations = {name: swarm.build_formation(name) for name in swarm.formation_names}
    order = Mission(NOW, "world", "start", NOW)

    def place(mission, held):
        report = Report("formation", mission=mission, place=held)
        return reported_place(swarm, formations, report, 2)

    assert place(order, 3) == (formations[""], 3)
    assert place(order, None) is None
    assert place(order, 4) is None
    assert place(None, 3) is None
    assert place(order._replace(verb="hold"), 3) is None
    assert place(order._replace(formation="row"), 3) == (formations["row"], 1)
    back = order._replace(change=Change(NOW, 2.0, "row", (0, 1, 2, 3), (3, 2, 1, 0)))
    formation, index = place(back, 3)
    assert formation.offset(index, 0.0) == formations["row"].offset(1, 0.0)
    assert formation.offset(index, 9.0) == formations[""].offset(3, 9.0)
    assert flown_place(formations, back, 1, None)[0].offset(1, 9.0) == formations[""].offset(2, 9.0)
