import pytest
from flockwire_core.domain.order import MISSION_VERBS, MOST_VERSIONS, Change, Mission
from flockwire_core.domain.time import SECOND
from flockwire_core.pilot.orders import Orders, flown_place, rank
from hypothesis import given
from hypothesis import strategies as st

NOW = 1_790_000_000 * SECOND
UP = [verb for verb in MISSION_VERBS if verb not in ("hold", "land")]


def order(verb, giver, number=0, *downs, stamp=NOW):
    return Mission(stamp, "world", verb, giver=giver, number=number, downs=tuple(one.version for one in downs))


def after(*given):
    """Return the orders of one who took these in, one after another."""
    orders = Orders()
    for one in given:
        orders.take(one, NOW)
    return orders


START = order("start", 1, 1)
HOLD, LAND = order("hold", 2), order("land", 3)


@pytest.mark.parametrize("verb", UP)
@pytest.mark.parametrize("down", [HOLD, LAND])
def test_nothing_takes_up_while_a_hold_or_landing_has_no_number(down, verb):
    orders = after(START, down, order(verb, 4, 2))
    assert (orders.mission.verb, orders.unnumbered) == (down.verb, (down.version,))
    orders.take(order(verb, 5, 4, down), NOW)
    assert (orders.mission.verb, orders.unnumbered) == (verb, ())


@pytest.mark.parametrize("verb", UP)
def test_what_takes_up_and_is_not_in_the_log_is_not_obeyed(verb):
    assert after(order(verb, 4)).mission is None
    assert after(START, order(verb, 4)).mission == START


def test_an_earlier_order_of_the_log_that_comes_late_changes_nothing():
    landed = order("land", 3, 2, LAND)
    assert after(START, landed, START).mission == landed
    assert after(landed, START).mission == landed


def test_a_landing_that_the_log_has_does_not_come_back():
    again = order("start", 4, 3, LAND)
    assert after(START, LAND, again, LAND).mission == again
    assert after(START, again, LAND).mission == again


def test_a_hold_takes_no_landing_back_but_must_be_numbered():
    orders = after(START, LAND, HOLD)
    assert (orders.mission.verb, orders.unnumbered) == ("land", (LAND.version, HOLD.version))
    orders.take(order("start", 6, 3, LAND), NOW)
    assert orders.mission.verb == "hold"


def test_a_number_ends_the_weaker_orders_that_came_before_too():
    """The gateway may never receive an order whose station is gone: it is given again."""
    again = order("land", 9)
    assert after(START, LAND, HOLD, again, order("start", 4, 3, again)).mission.verb == "start"
    assert after(START, again, LAND, order("start", 4, 3, again)).mission.verb == "land"
    assert after(START, LAND, HOLD, order("start", 4, 3, HOLD)).mission.verb == "land"


@given(st.permutations([START, HOLD, LAND, order("start", 6, 2), order("formation", 7, 4, HOLD), order("hold", 8)]))
def test_after_a_landing_that_the_log_has_not_received_all_land_in_whatever_order_things_arrive(arrivals):
    assert after(*arrivals).mission.verb == "land"


@given(st.permutations([START, HOLD, LAND, order("start", 4, 4, HOLD, LAND), order("hold", 2, 2, HOLD)]))
def test_of_all_orders_of_arrival_the_logs_newest_holds_when_all_is_numbered(arrivals):
    assert after(*arrivals).mission.giver == 4


def test_a_number_alone_is_no_other_order():
    orders = after(START)
    assert orders.take(LAND, NOW)
    assert not orders.take(order("land", 3, 2, LAND), NOW)
    assert (orders.number, orders.unnumbered) == (2, ())


def test_the_start_of_a_repeated_order_is_taken_over_once_the_own_clock_is_corrected():
    orders, start = Orders(), Mission(5, "world", "start", start=SECOND, giver=1, number=3)
    assert orders.take(start, 10)
    assert not orders.take(start.shift(7), 20)
    assert orders.mission == start.shift(7)
    assert orders.taken == 10


def test_the_age_is_that_of_the_newest_order():
    orders = Orders()
    assert orders.age(NOW) == -1.0
    orders.take(START, NOW)
    orders.take(LAND, NOW + SECOND)
    assert orders.age(NOW + 3 * SECOND) == 2.0


def test_however_many_orders_come_little_is_kept():
    orders = after(*[order("land", giver) for giver in range(100)])
    assert len(orders.unnumbered) == MOST_VERSIONS
    assert orders.mission.verb == "land"


def test_the_rank_of_no_order_is_the_lowest():
    assert [rank(each) for each in (None, START, HOLD, LAND)] == [-1, 0, 1, 2]


def test_the_place_of_an_auction_is_that_which_is_held(make_swarm):
    swarm = make_swarm({"formations": {"row": {"kind": "line", "spacing": 0.9}}})
    formations = {name: swarm.build_formation(name) for name in swarm.formation_names}
    order = Mission(NOW, "world", "start", NOW)
    assert flown_place(formations, order, 1, 3) == (formations[""], 3)
    back = order._replace(change=Change(NOW, 2.0, "row", (0, 1, 2, 3), (3, 2, 1, 0)))
    formation, index = flown_place(formations, back, 1, 3)
    assert formation.offset(index, 0.0) == formations["row"].offset(1, 0.0)
    assert formation.offset(index, 9.0) == formations[""].offset(3, 9.0)
    assert flown_place(formations, back, 1, None)[0].offset(1, 9.0) == formations[""].offset(2, 9.0)
