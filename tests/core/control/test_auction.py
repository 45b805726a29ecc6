from itertools import permutations
from math import inf, nan
from random import Random

import pytest
from flockwire.control.auction import NOBODY, TOLERANCE, Auction, Bid
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
        (0, (1.0, inf), 0.1, "finite"),
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
