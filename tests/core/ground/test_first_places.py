from itertools import permutations
from math import dist

import pytest
from flockwire_core.domain.order import Mission
from flockwire_core.domain.time import SECOND
from flockwire_core.ground.first_places import with_first_places, with_held_places
from flockwire_core.ground.fleet import Fleet
from flockwire_core.pilot.orders import flown_formation
from flockwire_core.wire.cdr import Reader, Writer
from flockwire_core.wire.orders import read_mission, write_mission
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.status import Report, Status
from hypothesis import given, settings
from hypothesis import strategies as st

NOW = 1_790_000_000 * SECOND
FREE = {"formation": {"kind": "circle", "radius": 1.5, "assignment": "free"}}
START = Mission(NOW, "world", "start", NOW + SECOND // 2)
coordinates = st.floats(-3.0, 3.0)
places = st.lists(st.tuples(coordinates, coordinates, st.just(1.0)), min_size=4, max_size=4)


def fleet(plan, positions):
    """Return what is known of pilots that hold at `positions`, by drone."""
    statuses = {
        plan.pilots[i]: Status(
            NOW, "world", plan.pilots[i], Report(Phase.HOLD, position=x), 0, 0, 0, 0, 0, 0.0, 0, (), ()
        )
        for i, x in positions.items()
    }
    return Fleet(plan.pilots, statuses, {}, NOW)


@pytest.fixture(scope="module")
def plan(make_plan):
    return make_plan(FREE)


def flown(swarm, order):
    formation = flown_formation({"": swarm.build_formation()}, order)
    return [formation.offset(rank, 0.0) for rank in range(formation.count)]


@settings(max_examples=30)
@given(positions=places)
def test_the_ways_are_the_shortest_and_every_place_is_taken(plan, positions):
    swarm = plan.swarm
    order = with_first_places(START, swarm, fleet(plan, dict(zip(swarm.followers, positions, strict=True))))
    fixed = [swarm.build_formation().offset(rank, 0.0) for rank in range(4)]

    def total(chosen):
        return sum(dist(x, place) ** 2 for x, place in zip(positions, chosen, strict=True))

    found = flown(swarm, order)
    assert sorted(found) == sorted(fixed)
    assert total(found) <= min(map(total, permutations(fixed))) + 1e-9


def test_the_order_passes_the_wire_and_its_change_is_over_when_the_formation_starts(plan):
    swarm = plan.swarm
    there = {i: swarm.build_formation().offset(4 - i, 0.0) for i in swarm.followers}  # the reverse of their ranks
    order = with_first_places(START, swarm, fleet(plan, there))
    assert order.change.places == order.change.places_before == (3, 2, 1, 0)
    assert order.change.begin + order.change.duration * SECOND <= order.start
    writer = Writer()
    write_mission(writer, order)
    assert read_mission(order.stamp, "world", Reader(writer.finish())) == order


def test_drones_that_are_left_out_keep_their_places(plan):
    swarm = plan.swarm
    fixed = swarm.build_formation()
    there = {1: fixed.offset(3, 0.0), 3: fixed.offset(0, 0.0), 4: fixed.offset(2, 0.0)}
    order = with_first_places(START._replace(without=(2,)), swarm, fleet(plan, there))
    assert order.change.places == (3, 1, 0, 2)


def test_it_stays_by_rank_while_a_position_is_unknown_and_if_ranks_are_best(plan, make_plan):
    swarm = plan.swarm
    fixed = swarm.build_formation()
    by_rank = {i: fixed.offset(i - 1, 0.0) for i in swarm.followers}
    swapped = {**by_rank, 1: by_rank[2], 2: by_rank[1]}
    assert with_first_places(START, swarm, fleet(plan, by_rank)) is START
    assert with_first_places(START, swarm, fleet(plan, {**swapped, 4: None})) is START
    assert with_first_places(START, swarm, fleet(plan, {i: swapped[i] for i in (1, 2, 3)})) is START
    assert with_first_places(START, swarm, fleet(plan, swapped)).change.places == (1, 0, 2, 3)
    ranks = make_plan()
    assert with_first_places(START, ranks.swarm, fleet(ranks, swapped)) is START


def reporting(plan, places):
    """Return what is known of pilots that report these places, by drone."""
    reports = {i: Report(Phase.FORMATION, place=place) for i, place in places.items()}
    statuses = {
        plan.pilots[i]: Status(NOW, "world", plan.pilots[i], report, 0, 0, 0, 0, 0, 0.0, 0, (), ())
        for i, report in reports.items()
    }
    return Fleet(plan.pilots, statuses, {}, NOW)


def test_a_change_begins_at_the_places_that_the_followers_report(plan, make_plan):
    edges = {"graph.edges": [[0, 1], [1, 2], [2, 3], [3, 4], [4, 1]]}
    auctioned = make_plan({**edges, "formation.assignment": "auction"})
    held = {1: 2, 2: 0, 3: 3, 4: 1}
    assert with_held_places(START, auctioned.swarm, reporting(auctioned, held)).change.places == (2, 0, 3, 1)
    assert with_held_places(START, plan.swarm, reporting(plan, held)) is START
    for unknown in ({**held, 4: None}, {**held, 4: 2}, {1: 2, 2: 0, 3: 3}):
        assert with_held_places(START, auctioned.swarm, reporting(auctioned, unknown)) is None
    absent = START._replace(without=(2,))
    found = with_held_places(absent, auctioned.swarm, reporting(auctioned, {1: 2, 3: 3, 4: 0}))
    assert found.change.places == (2, 1, 3, 0)
