from itertools import permutations
from math import inf, nan
from random import Random

import pytest
from flockwire_core.control.auction import NOBODY, TOLERANCE, Auction, Bid, held_place
from hypothesis import given
from hypothesis import strategies as st

LEAST = 0.01  # m^2


def held(costs, links, loss=0.0, seed=0, rounds=20000):
    """Run the auction over directed `links` (source, target); return the places when nobody bids any more."""
    chance, agents = Random(seed), [Auction(i, row, LEAST) for i, row in enumerate(costs)]
    calm = 0
    for _ in range(rounds):
        for agent in agents:
            agent.bid()
        told = [tuple(agent.bids) for agent in agents]
        for source, target in links:
            if chance.random() >= loss:
                agents[target].take(told[source])
        settled = all(agent.bids == agents[0].bids for agent in agents)
        calm = calm + 1 if settled and all(agent.place is not None for agent in agents) else 0
        if calm == 2:
            return [agent.place for agent in agents]
    raise AssertionError("the auction does not end")


def least_sum(costs):
    ranks = range(len(costs))
    return min(sum(costs[i][j] for i, j in enumerate(places)) for places in permutations(ranks))


def ring(count):
    return [(i, (i + 1) % count) for i in range(count)] if count > 1 else []


tables = st.integers(1, 5).flatmap(
    lambda n: st.lists(st.lists(st.floats(0.0, 9.0), min_size=n, max_size=n), min_size=n, max_size=n)
)


@given(tables)
def test_on_a_one_way_ring_each_gets_a_place_within_the_bound(costs):
    places, count = held(costs, ring(len(costs))), len(costs)
    assert sorted(places) == list(range(count))
    assert sum(costs[i][j] for i, j in enumerate(places)) <= (1 + TOLERANCE) * least_sum(costs) + count * LEAST + 1e-9


@given(tables, st.integers(0, 9))
def test_lost_bids_only_delay(costs, seed):
    places, count = held(costs, ring(len(costs)), 0.4, seed), len(costs)
    assert sorted(places) == list(range(count))
    assert sum(costs[i][j] for i, j in enumerate(places)) <= (1 + TOLERANCE) * least_sum(costs) + count * LEAST + 1e-9


def test_the_higher_of_two_equal_bids_is_that_of_the_higher_number():
    one, two = Auction(1, (0.0, 5.0), LEAST), Auction(2, (0.0, 5.0), LEAST)
    one.bid()
    two.bid()
    assert one.bids[0].price == two.bids[0].price
    one.take(two.bids)
    two.take(one.bids)
    assert (one.place, two.place) == (None, 0)
    one.bid()
    assert one.place == 1  # two has raised the first place by what the second is worse, and one step more


def test_a_price_never_falls_and_a_repeated_bid_changes_nothing():
    agent = Auction(1, (1.0, 2.0), LEAST)
    agent.bid()
    before = list(agent.bids)
    agent.take([Bid(0.0, NOBODY), Bid(0.5, 3)])
    agent.take([Bid(0.0, NOBODY), Bid(0.5, 3)])
    assert agent.bids == [before[0], Bid(0.5, 3)]
    assert agent.place == 0


@pytest.mark.parametrize(
    ("number", "costs", "least", "rule"),
    [
        (0, (), 0.1, "costs"),
        (0, (1.0, -1.0), 0.1, "none negative"),
        (0, (inf, inf), 0.1, "finite"),
        (0, (1.0, nan), 0.1, "costs"),
        (0, (1.0,), 0.0, "least = 0.0"),
        (0, (1.0,), inf, "least = inf"),
        (NOBODY, (1.0,), 0.1, "number = -1"),
    ],
)
def test_numbers_out_of_range_are_refused(number, costs, least, rule):
    with pytest.raises(ValueError, match=rule):
        Auction(number, costs, least)


@pytest.mark.parametrize(
    "bids",
    [[Bid(1.0, 2)], [Bid(1.0, 2)] * 3, [Bid(1.0, 2), Bid(nan, 2)], [Bid(1.0, 2), Bid(inf, 2)], [Bid(1.0, -2)] * 2],
)
def test_malformed_bids_are_dropped_whole(bids):
    agent = Auction(1, (1.0, 2.0), LEAST)
    with pytest.raises(ValueError, match="bids"):
        agent.take(bids)
    assert agent.bids == [Bid(0.0, NOBODY)] * 2


@given(tables, st.integers(0, 9))
def test_no_price_is_above_twice_the_largest_cost_and_step(costs, seed):
    chance, largest = Random(seed), max(map(max, costs))
    agents = [Auction(i, row, LEAST) for i, row in enumerate(costs)]
    highest = 2.0 * (largest + max(TOLERANCE * largest, LEAST))
    for _ in range(200):
        for agent in agents:
            agent.bid()
        told = [tuple(agent.bids) for agent in agents]
        for source, target in ring(len(costs)):
            if chance.random() >= 0.4:
                agents[target].take(told[source])
    assert max(bid.price for agent in agents for bid in agent.bids) <= highest + 1e-9


@given(tables, st.integers(0, 40), st.booleans(), st.randoms(use_true_random=False))
def test_a_process_that_is_started_again_gets_a_place_and_nobody_shares_it(costs, after, listens, chance):
    agents, links = [Auction(i, row, LEAST, most=1e4) for i, row in enumerate(costs)], ring(len(costs))
    again, told = chance.randrange(len(costs)), list[tuple[Bid, ...]]()
    for step in range(4000):
        if step == after:
            agents[again] = Auction(again, costs[again], LEAST, most=1e4)
        for agent in agents:
            if not (listens and agent is agents[again] and after <= step < after + 8):
                agent.bid()
        before, told = told, [tuple(agent.bids) for agent in agents]
        if told == before and step > after + 8:
            break  # a bid follows from those that were received: nothing changes any more
        for source, target in links:
            agents[target].take(told[source])
    assert sorted(agent.place for agent in agents) == list(range(len(costs)))


def test_a_process_that_listens_first_finds_its_old_place():
    neighbours = [Bid(3.0, 2), Bid(1.5, 1), Bid(0.7, 3)]
    agent = Auction(1, (0.0, 5.0, 5.0), LEAST)
    agent.take(neighbours)
    agent.bid()
    assert (agent.place, agent.bids) == (1, neighbours)


def test_of_two_places_with_one_bidder_the_dearer_one_is_its_own():
    assert held_place([Bid(1.0, 4), Bid(2.0, 4), Bid(3.0, 5)], 4) == 1
    assert held_place([Bid(1.0, 4), Bid(2.0, 4), Bid(3.0, 5)], 6) is None
    assert held_place([Bid(0.0, NOBODY)], NOBODY + 7) is None


def test_a_place_of_infinite_cost_is_not_to_be_had():
    one, two = Auction(1, (inf, 4.0, 1.0), LEAST), Auction(2, (inf, 9.0, 1.0), LEAST)
    for _ in range(20):
        one.bid()
        two.bid()
        one.take(two.bids)
        two.take(one.bids)
    assert (one.place, two.place) == (1, 2)
    assert one.bids[0] == Bid(0.0, NOBODY)


def test_it_does_not_bid_above_the_highest_price():
    agent = Auction(1, (1.0, 2.0), LEAST, most=8.0)
    agent.take([Bid(8.0, 2), Bid(8.0, 2)])
    agent.bid()
    assert agent.place is None
    assert agent.bids == [Bid(8.0, 2)] * 2


@pytest.mark.parametrize("bid", [Bid(8.1, 2), Bid(1.0, 4), Bid(1.0, NOBODY)])
def test_bids_above_the_highest_price_or_of_others_are_dropped(bid):
    agent = Auction(1, (1.0, 2.0), LEAST, most=8.0, bidders={1, 2, 3})
    with pytest.raises(ValueError, match="bids"):
        agent.take([Bid(1.0, 2), bid])
    assert agent.bids == [Bid(0.0, NOBODY)] * 2
