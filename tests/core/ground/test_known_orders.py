"""What one giver reads in the gateway's log, and what becomes of its own order."""

import pytest
from flockwire_core.domain.order import Mission
from flockwire_core.domain.time import SECOND
from flockwire_core.ground.fleet import Fleet
from flockwire_core.ground.order_log import PATIENCE, UNKNOWN, KnownOrders
from flockwire_core.wire.status import Report, Status

NOW = 1_790_000_000 * SECOND
ASKED = NOW - SECOND
OURS, THEIRS = 7, 8


def order(verb, number, giver=THEIRS, downs=()):
    made = Mission(NOW - 5 * SECOND + number, "world", verb, giver=giver, number=number)
    return made._replace(downs=(*downs, *((made.version,) if verb in ("hold", "land") else ())))


def fleet(log, age=60.0, now=NOW, **pilots):
    """Return a fleet whose gateway has `log`, received `age` s ago."""
    reports = {"gateway": Report("tracking", mission=log, order_age=age), **pilots}
    statuses = {name: Status(now, "world", name, r, 0, 0, 0, 0, 0, 0.0, 0, (), ()) for name, r in reports.items()}
    return Fleet({0: "leader", 1: "uav1"}, statuses, {}, now)


@pytest.fixture
def known():
    return KnownOrders(OURS, ASKED)


START = order("start", 1)
LAND = order("land", 2)


@pytest.mark.parametrize("verb", ["hold", "land"])
def test_what_goes_down_and_came_after_the_request_is_news_at_the_first_look(known, verb):
    assert known.read(fleet(order(verb, 2), age=0.5)) == verb


@pytest.mark.parametrize(("log", "age"), [(LAND, 1.5), (START, 0.5), (None, -1.0), (order("land", 2, OURS), 0.5)])
def test_what_was_there_before_or_takes_up_or_is_its_own_is_no_news(known, log, age):
    assert known.read(fleet(log, age)) == ""


def test_what_comes_later_is_news_once(known):
    known.read(fleet(START))
    assert [known.read(fleet(log)) for log in (START, LAND, LAND)] == ["", "land", ""]


def test_a_second_landing_and_a_hold_beside_it_are_news(known):
    known.read(fleet(LAND))
    second = order("land", 3, giver=9, downs=LAND.downs)
    assert known.read(fleet(second)) == "land"
    assert known.read(fleet(second._replace(number=4, downs=(*second.downs, order("hold", 4).version)))) == "land"


def test_a_landing_that_an_upward_order_has_replaced_is_news_too(known):
    known.read(fleet(START))
    assert known.read(fleet(order("start", 3, downs=LAND.downs))) == UNKNOWN


def test_without_the_gateway_nothing_is_read(known):
    silent = Fleet({0: "leader"}, {}, {}, NOW)
    assert known.read(silent) == ""
    assert known.read(fleet(LAND, age=0.5)) == "land"


def test_a_proposal_names_the_number_that_was_read(known):
    known.read(fleet(LAND))
    assert known.give(order("start", 0)).number == 2
    assert known.give(order("land", 9)).number == 0
    assert len({known.give(order(verb, 0)).version for verb in ("hold", "land", "start")}) == 3


def test_another_upward_order_in_its_place_is_followed(known):
    known.read(fleet(START))
    own = known.give(order("formation", 0))
    assert not known.settle(NOW)
    other = order("formation", 2, giver=9)
    known.read(fleet(other))
    assert not known.settle(NOW)
    assert (known.order, known.is_own) == (other, False)
    assert known.order != own


def test_an_accepted_one_stands(known):
    known.read(fleet(START))
    own = known.give(order("formation", 0))
    known.read(fleet(own._replace(number=2)))
    assert not known.settle(NOW)
    assert (known.order, known.is_own) == (own, True)


@pytest.mark.parametrize("log", [START._replace(number=5), order("hold", 5, giver=OURS)])
def test_where_only_the_number_changed_or_by_an_own_order_it_is_given_again(known, log):
    known.read(fleet(START))
    first = known.give(order("formation", 0))
    known.read(fleet(log))
    assert known.settle(NOW)
    assert known.order.number == 5
    assert known.order.version != first.version


@pytest.mark.parametrize("verb", ["hold", "land"])
def test_what_goes_down_is_never_settled(known, verb):
    known.read(fleet(START))
    own = known.give(order(verb, 0))
    known.read(fleet(order("start", 2)))
    assert not known.settle(NOW)
    assert known.order == own


def test_an_order_that_only_a_pilot_obeys_is_unclear_for_a_while(known):
    lands = Report("landing", mission=LAND._replace(number=0), unnumbered=(LAND.version,))
    known.read(fleet(START, uav1=lands))
    assert known.is_unclear(NOW)
    known.read(fleet(START, now=NOW + PATIENCE, uav1=lands))
    assert not known.is_unclear(NOW + PATIENCE)
    known.read(fleet(LAND, uav1=lands))
    assert not known.is_unclear(NOW)
