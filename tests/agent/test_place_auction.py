"""One follower's part in the auctions of formations, order by order."""

from math import dist, inf

import pytest
from flockwire_agent.place_auction import LISTENING, REPEAT, PlaceAuction, most_cost
from flockwire_core.control.auction import LEAST, NOBODY, bids_of, highest_price
from flockwire_core.domain.law_message import LawMessage
from flockwire_core.domain.motion import LeaderMotion, Motion
from flockwire_core.domain.order import Change, Mission
from flockwire_core.domain.time import SECOND
from flockwire_core.wire.keys import Key
from flockwire_core.wire.law_form import LawForm
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.status import NO_PLACE_YET, Report

BORN = 1_790_000_000 * SECOND
NOW = BORN + 5 * SECOND
EDGES = [[0, 1], [1, 2], [2, 3], [3, 4], [4, 1]]
TABLE = {
    "graph.edges": EDGES,
    "formation": {"kind": "circle", "radius": 2.0, "assignment": "auction"},
    "formations": {"row": {"kind": "line", "spacing": 0.9}, "block": {"kind": "grid", "assignment": "auction"}},
}
ORDER = Mission(NOW, "world", "start", NOW + SECOND // 2, giver=3)
LEADER = LeaderMotion((1.0, 1.0, 1.0))
TICK = SECOND // 100


@pytest.fixture
def swarm(make_swarm):
    return make_swarm(TABLE)


def part(swarm, number=2, born=BORN):
    shapes = {name: swarm.build_formation(name) for name in swarm.formation_names}
    return PlaceAuction(swarm, number, shapes, born)


def at(swarm, rank, beside=0.0, formation=""):
    """Return the motion of a drone at a place, or beside it."""
    x, y, z = swarm.build_formation(formation).offset(rank, 0.0)
    place = (x + 1.0 + beside, y + 1.0, z + 1.0)
    return Motion(place, (0.0, 0.0, 0.0), place)


def told(*bids, order=ORDER):
    return bids_of(len(bids))(*order.version, *zip(*bids, strict=True))


FREE = (0.0, NOBODY)


def test_it_bids_for_the_nearest_place_once_it_knows_where_it_and_the_leader_are(swarm):
    one = part(swarm)
    one.order(ORDER, NOW)
    assert one.step(Phase.HOLD, None, LEADER, NOW) is None
    assert one.step(Phase.HOLD, at(swarm, 3), None, NOW) is None
    bids = one.step(Phase.HOLD, at(swarm, 3), LEADER, NOW + TICK)
    assert one.place == 3
    assert (bids.stamp, bids.giver, bids.bidders) == (*ORDER.version, (NOBODY, NOBODY, NOBODY, 2))
    offset = swarm.build_formation().offset
    assert bids.prices[3] == pytest.approx(dist(offset(3, 0.0), offset(0, 0.0)) ** 2 + LEAST)


def test_costs_do_not_change_with_its_position(swarm):
    one = part(swarm)
    one.order(ORDER, NOW)
    one.step(Phase.HOLD, at(swarm, 3), LEADER, NOW)
    one.take(told(FREE, FREE, FREE, (50.0, 4)))
    one.step(Phase.HOLD, at(swarm, 1), LEADER, NOW + TICK)
    assert one.place in (0, 2)  # beside the place where it was, not where it is


def test_bids_are_published_when_they_change_and_again_and_again(swarm):
    one, stamps, now = part(swarm), [], NOW
    one.order(ORDER, NOW)
    changed = NOW + REPEAT + 2 * TICK
    for _ in range(30):
        if one.step(Phase.HOLD, at(swarm, 3), LEADER, now) is not None:
            stamps.append(now)
        now += TICK
        if now == changed:
            one.take(told((1.0, 1), FREE, FREE, FREE))
    assert stamps == [NOW, NOW + REPEAT, *range(changed, now, REPEAT)]  # what a neighbour bids is passed on at once


def test_bids_of_another_order_and_bids_that_nobody_can_have_made_are_dropped(swarm):
    one = part(swarm)
    one.order(ORDER, NOW)
    one.step(Phase.HOLD, at(swarm, 3), LEADER, NOW)
    most = highest_price(4, most_cost(swarm))
    one.take(told(FREE, FREE, FREE, (50.0, 4), order=ORDER._replace(giver=4)))
    assert (one.place, one.rejected) == (3, 0)
    for bids in ([(50.0, 4)], [(50.0, 4)] * 5, [FREE, FREE, FREE, (50.0, 7)], [FREE, FREE, FREE, (1.01 * most, 4)]):
        one.take(told(*bids))
    assert (one.place, one.rejected) == (3, 4)
    assert one.reported(Report("formation")).counts == (("bids rejected", 4),)
    one.take(told(FREE, FREE, FREE, (most, 4)))
    assert one.place is None
    assert one.reported(Report("formation")).reasons[0] == NO_PLACE_YET


def test_who_lands_or_stands_keeps_what_it_holds_and_does_not_bid_again_but_passes_bids_on(swarm):
    one = part(swarm)
    one.order(ORDER, NOW)
    one.step(Phase.FORMATION, at(swarm, 3), LEADER, NOW)
    assert one.step(Phase.LANDING, at(swarm, 3), LEADER, NOW + SECOND).bidders[3] == 2
    one.take(told(FREE, FREE, FREE, (50.0, 4)))
    bids = one.step(Phase.GROUNDED, at(swarm, 3), LEADER, NOW + SECOND + TICK)
    assert bids.bidders == (NOBODY, NOBODY, NOBODY, 4)
    assert one.place is None


def test_a_process_that_is_younger_than_the_order_waits_for_its_old_bids(swarm):
    one = part(swarm, born=NOW + SECOND)
    one.order(ORDER, NOW + 2 * SECOND)
    for _ in range(10):
        one.step(Phase.HOLD, at(swarm, 3), LEADER, NOW + 2 * SECOND + TICK)
    assert one.place is None
    one.take(told((2.0, 4), (3.0, 2), (1.0, 1), (2.0, 3)))
    assert one.place == 1
    one.step(Phase.HOLD, at(swarm, 3), LEADER, NOW + 2 * SECOND + 2 * TICK)
    assert one.place == 1


def test_a_young_process_of_which_nobody_has_a_bid_bids_after_a_while(swarm):
    one = part(swarm, born=NOW + SECOND)
    one.order(ORDER, NOW + 2 * SECOND)
    one.step(Phase.HOLD, at(swarm, 3), LEADER, NOW + 2 * SECOND + LISTENING - 1)
    assert one.place is None
    one.take(told((0.5, 1), FREE, FREE, FREE))
    bids = one.step(Phase.HOLD, at(swarm, 2), LEADER, NOW + 2 * SECOND + LISTENING)
    assert one.place == 2  # by the costs at that time: its first estimate may have been a guess
    assert (bids.prices[0], bids.bidders[0]) == (0.5, 1)


def test_each_order_begins_an_auction_and_a_hold_leaves_the_place(swarm):
    one = part(swarm)
    one.order(ORDER, NOW)
    one.step(Phase.HOLD, at(swarm, 3), LEADER, NOW)
    hold = Mission(NOW + SECOND, "world", "hold", ORDER.start)
    one.order(hold, NOW + SECOND)
    assert one.step(Phase.HOLD, at(swarm, 1), LEADER, NOW + SECOND) is None
    assert one.place == 3
    assert one.reported(Report("hold")).place == 3
    one.order(ORDER._replace(stamp=NOW + 2 * SECOND), NOW + 2 * SECOND)
    assert one.place is None
    one.step(Phase.HOLD, at(swarm, 1), LEADER, NOW + 2 * SECOND)
    assert one.place == 1
    one.order(ORDER._replace(stamp=NOW + 3 * SECOND, formation="row"), NOW + 3 * SECOND)
    assert (one.place, one.ordered) == (None, False)
    assert one.reported(Report("formation")) == Report("formation")


def test_the_places_of_drones_that_are_left_out_are_not_to_be_had(swarm):
    one = part(swarm)
    absent = ORDER._replace(without=(4,))
    one.order(absent, NOW)
    bids = one.step(Phase.HOLD, at(swarm, 3), LEADER, NOW)
    assert one.place in (0, 2)
    assert bids.bidders[3] == NOBODY
    one.take(told((1.0, 4), FREE, FREE, FREE, order=absent))  # it does not fly
    assert one.rejected == 1


def test_in_a_change_a_place_costs_the_way_from_the_old_place_half_way_through_it(swarm):
    one = part(swarm)
    change = Change(NOW + SECOND, 4.0, "", (0, 3, 2, 1), (0, 1, 2, 3))
    order = ORDER._replace(verb="formation", formation="block", change=change)
    one.order(order, NOW)
    one.step(Phase.FORMATION, at(swarm, 0), LEADER, NOW)  # wherever it is
    old = swarm.build_formation().offset(3, (change.begin - order.start) / SECOND + 2.0)
    block = swarm.build_formation("block")
    assert one.place == min(range(4), key=lambda rank: dist(old, block.offset(rank, 0.0)))
    over = part(swarm)
    over.order(order, NOW)
    over.step(Phase.FORMATION, at(swarm, 0, formation="block"), LEADER, NOW + 6 * SECOND)
    assert over.place == 0


@pytest.mark.sources  # replaces compiled functions
def test_a_place_without_a_position_costs_the_most(make_swarm):
    table = {**TABLE, "formation": {"kind": "expression", "x": "2*i", "y": "1", "assignment": "auction"}}
    swarm = make_swarm(table)

    class Undefined:
        count = 4

        def offset(self, index, _):
            return (inf - inf if index == 0 else 2.0 * index, 0.0, 0.0)

    one = PlaceAuction(swarm, 2, {"": Undefined()}, BORN)
    one.order(ORDER, NOW)
    bids = one.step(Phase.HOLD, Motion((0.0, 0.0, 1.0), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)), LEADER, NOW)
    assert one.place == 1
    assert bids.prices[1] < highest_price(4, most_cost(swarm))


@pytest.mark.parametrize("far", [1e200, -1.7e308])
def test_wherever_a_neighbour_claims_the_leader_is_it_bids(swarm, far):
    one = part(swarm)
    one.order(ORDER, NOW)
    bids = one.step(Phase.HOLD, at(swarm, 3), LeaderMotion((far, far, 1.0)), NOW)
    most = most_cost(swarm)
    assert bids.prices[one.place] < highest_price(4, most)


@pytest.mark.parametrize("without", [(2,), (1, 2, 3, 4)])
def test_who_is_left_out_in_flight_does_not_bid_and_has_the_place_of_its_rank(cockpit, without):
    agent = cockpit(TABLE | {"graph.edges": [*EDGES, [0, 2]]}, number=2).fly()
    agent.order("formation", agent.now, without=without)
    messages = dict(agent.core.step(agent.now + TICK))
    assert agent.phase is Phase.FORMATION
    assert agent.report.place == 1
    assert messages[Key("law", "uav2")].contents == ()  # a sign of life
    packed = LawForm(bids_of(4)).pack(told((9.0, 2), FREE, FREE, FREE))
    agent.core.receive(Key("law", "uav1"), LawMessage(agent.now, "world", BORN, 1, ((agent.now, packed),)), agent.now)
    agent.run(0.1)
    assert agent.report.place == 1
    agent.order("formation", agent.now)
    agent.run(0.1)
    assert agent.report.place is not None
    assert "bids rejected" not in dict(agent.report.counts)
    short = LawMessage(agent.now, "world", BORN, 2, ((agent.now, packed[:-8]),))
    agent.core.receive(Key("law", "uav1"), short, agent.now)
    agent.run(0.1)
    assert dict(agent.report.counts)["bids rejected"] == 1


def test_who_does_not_know_where_it_is_passes_bids_on_and_bids_once_it_knows(swarm):
    one = part(swarm)
    one.order(ORDER, NOW)
    assert one.step(Phase.HOLD, None, LEADER, NOW) is None
    one.take(told((4.0, 1), FREE, (3.0, 3), FREE))
    bids = one.step(Phase.HOLD, None, None, NOW + TICK)
    assert bids.bidders == (1, NOBODY, 3, NOBODY)
    assert one.place is None
    assert one.step(Phase.HOLD, at(swarm, 3), LEADER, NOW + 2 * TICK).bidders[3] == 2
    assert one.place == 3
