"""The order that stands for one giver: given, followed, and settled with a rival that crossed it."""

import pytest
from flockwire_core.domain.order import Mission
from flockwire_core.domain.time import SECOND
from flockwire_core.ground.fleet import Fleet
from flockwire_core.ground.standing import RIVALS, Standing
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.status import Report, Status
from repeated_orders import repeated

NOW = 1_790_000_000 * SECOND
OURS = 7
PILOTS = {0: "leader", 1: "uav1"}
START = Mission(NOW, "world", "start", NOW)


def fleet(obeyed, age=0.1, now=NOW):
    """Return a fleet whose uav1 has obeyed `obeyed` for `age` s."""
    report = Report(Phase.FORMATION, mission=obeyed, order_age=age)
    status = Status(now, "world", "uav1", report, 0, 0, 0, 0, 0, 0.0, 0, (), ())
    return Fleet(PILOTS, {"uav1": status}, {}, now, repeated([status]))


@pytest.fixture
def standing():
    """Return what stands after a start was given."""
    made = Standing(OURS, NOW)
    made.give(START)
    return made


def test_what_is_given_stands_from_its_stamp_on(standing):
    assert (standing.order.verb, standing.order.giver, standing.since, standing.is_own) == ("start", OURS, NOW, True)
    assert standing.started == standing.order


def test_a_hold_keeps_which_formation_was_started(standing):
    started = standing.order
    standing.give(Mission(NOW + 1, "world", "hold"))
    assert (standing.order.verb, standing.started) == ("hold", started)


def test_a_rival_with_a_larger_number_is_followed(standing):
    rival = START._replace(giver=OURS + 1)
    assert not standing.settle(fleet(rival))
    assert (standing.order, standing.is_own) == (rival, False)


def test_over_a_rival_with_a_smaller_number_the_own_order_is_given_again(standing):
    first, rival = standing.order, START._replace(giver=OURS - 1)
    standing.look(fleet(rival))
    assert standing.settle(fleet(rival))
    assert standing.is_own
    assert standing.order.version != first.version
    assert set(standing.order.knows) == {first.version, rival.version}


def test_what_a_pilot_obeyed_long_before_is_not_a_rival_whatever_its_number(standing):
    assert standing.settle(fleet(START._replace(giver=OURS + 1), age=RIVALS + 0.1))
    assert standing.is_own


@pytest.mark.parametrize("verb", ["hold", "land"])
def test_what_goes_down_has_no_rival(standing, verb):
    standing.give(Mission(NOW + 1, "world", verb))
    assert not standing.settle(fleet(START._replace(giver=OURS + 1)))
    assert standing.is_own
