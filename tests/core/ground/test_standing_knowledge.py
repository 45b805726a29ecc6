import pytest
from flockwire_core.domain.order import MOST_VERSIONS, Mission
from flockwire_core.domain.time import SECOND
from flockwire_core.ground.fleet import Fleet
from flockwire_core.ground.standing import HISTORY, Standing
from flockwire_core.pilot.orders import came_down
from flockwire_core.wire.status import Report, Status
from repeated_orders import repeated

NOW = 1_790_000_000 * SECOND
ASKED = NOW - SECOND
PILOTS = {0: "leader", 1: "uav1"}
OURS, THEIRS = 7, 8


def order(verb, *knows, giver=THEIRS, stamp=NOW - 5 * SECOND):
    return Mission(stamp, "world", verb, giver=giver, knows=tuple(one.version for one in knows))


def fleet(age=60.0, ages=(), **obeyed):
    """Return a fleet by who obeys what, for `age` s; `ages` of those for whom it is another."""
    reports = {
        name: Report("hold", mission=mission, concurrent=tuple(concurrent), order_age=dict(ages).get(name, age))
        for name, (mission, *concurrent) in obeyed.items()
    }
    statuses = {name: Status(NOW, "world", name, r, 0, 0, 0, 0, 0, 0.0, 0, (), ()) for name, r in reports.items()}
    return Fleet(PILOTS, statuses, {}, NOW, repeated(statuses.values()))


@pytest.fixture
def knowledge():
    return Standing(OURS, ASKED)


START, HOLD, LAND = order("start"), order("hold", giver=9), order("land", giver=10)


def test_an_order_names_what_all_pilots_obey_and_what_that_was_made_from(knowledge):
    again = order("start", START, stamp=NOW)
    assert knowledge.look(fleet(leader=[again], uav1=[HOLD, came_down(START)])) is None
    given = knowledge.give(order("start"))
    assert set(given.knows) == {START.version, again.version, HOLD.version, came_down(START)}
    assert given.giver == OURS


@pytest.mark.parametrize("down", [HOLD, LAND])
def test_what_goes_down_and_came_after_this_was_asked_for_is_news_at_the_first_look_too(knowledge, down):
    assert knowledge.look(fleet(age=0.5, leader=[down])) == down


def test_what_held_before_this_was_asked_for_is_no_news(knowledge):
    assert knowledge.look(fleet(age=1.5, leader=[LAND])) is None
    assert knowledge.holding == LAND


def test_what_comes_later_is_news_once(knowledge):
    knowledge.look(fleet(leader=[START], uav1=[START]))
    assert [knowledge.look(fleet(leader=[START], uav1=[HOLD])) for _ in range(2)] == [HOLD, None]


def test_a_second_landing_is_news_though_the_first_ranks_before_it(knowledge):
    second = order("land", giver=9)
    knowledge.look(fleet(leader=[LAND], uav1=[LAND]))
    assert knowledge.look(fleet(leader=[LAND], uav1=[second])) == second
    assert knowledge.look(fleet(leader=[second], uav1=[second])) is None


def test_a_second_landing_that_came_after_this_was_asked_for_is_news_at_the_first_look_too(knowledge):
    second = order("land", giver=9)
    assert knowledge.look(fleet(ages={"uav1": 0.5}, leader=[LAND], uav1=[second])) == second


def test_a_hold_that_comes_to_those_who_land_is_news(knowledge):
    knowledge.look(fleet(leader=[LAND], uav1=[LAND]))
    news = knowledge.look(fleet(leader=[LAND, HOLD.version], uav1=[LAND]))
    assert (news.verb, news.version) == ("hold", HOLD.version)
    assert knowledge.look(fleet(leader=[LAND, HOLD.version], uav1=[LAND, HOLD.version])) is None


def test_a_hold_that_came_to_those_who_land_after_this_was_asked_for_is_news_at_the_first_look_too(knowledge):
    news = knowledge.look(fleet(ages={"leader": 0.5}, leader=[LAND, HOLD.version], uav1=[LAND]))
    assert (news.verb, news.version) == ("hold", HOLD.version)


def test_a_landing_is_news_though_a_start_that_ends_it_is_news_too(knowledge):
    knowledge.look(fleet(leader=[START], uav1=[START]))
    assert knowledge.look(fleet(leader=[order("start", LAND, giver=11)], uav1=[LAND])) == LAND


def test_an_old_order_of_a_pilot_received_for_the_first_time_is_no_news(knowledge):
    second = order("land", giver=9)
    knowledge.look(fleet(leader=[LAND]))
    assert knowledge.look(fleet(leader=[LAND], uav1=[second, START.version])) is None
    assert {LAND.version, second.version, START.version} <= set(knowledge.give(order("start")).knows)


def test_a_hold_that_has_only_reached_the_gateway_is_neither_named_nor_lost(knowledge):
    knowledge.look(fleet(leader=[START], uav1=[START]))
    assert knowledge.look(fleet(leader=[START], uav1=[START], gateway=[HOLD])) is None
    assert HOLD.version not in knowledge.give(order("formation")).knows
    assert knowledge.look(fleet(leader=[HOLD], uav1=[START], gateway=[HOLD])) == HOLD


def test_what_takes_up_and_holds_for_the_gateway_alone_is_named_or_it_would_repeat_it_for_good(knowledge):
    knowledge.look(fleet(leader=[HOLD], uav1=[HOLD], gateway=[START]))
    assert START.version in knowledge.give(order("start")).knows


def test_the_own_order_is_no_news(knowledge):
    knowledge.look(fleet(leader=[START]))
    own = knowledge.give(order("start"))
    assert knowledge.look(fleet(leader=[own])) is None


def test_each_order_has_a_version_of_its_own(knowledge):
    assert len({knowledge.give(order(verb, stamp=NOW)).version for verb in ("hold", "land", "start")}) == 3


def test_what_is_named_stays_little_and_has_all_that_holds(knowledge):
    for stamp in range(1, 200):
        knowledge.look(fleet(leader=[order("hold", stamp=stamp)], uav1=[START]))
    known = knowledge.give(order("start")).knows
    assert len(known) == HISTORY < MOST_VERSIONS
    assert {order("hold", stamp=199).version, START.version} <= set(known)
