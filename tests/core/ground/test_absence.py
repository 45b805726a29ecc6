"""A flight without some of its drones: what the graph allows, and what is told of it."""

import pytest
from flockwire_core.ground.absence import consequences, refusal

EDGES = {"graph.edges": [[0, 1], [1, 2], [2, 3], [3, 4], [2, 4]]}


@pytest.mark.parametrize(
    ("without", "reason"),
    [
        ((), ""),
        ((3,), ""),
        ((3, 4), ""),
        ((0,), "--without 0: a leader cannot be left out"),
        ((7,), "--without 7: must be one of [1, 2, 3, 4]"),
        ((2,), "--without 2: no spanning tree from a leader is left, none reaches uav3, uav4"),
        ((1, 2, 3, 4), "--without 1, 2, 3, 4: at least one follower must fly"),
    ],
)
def test_the_graph_that_is_left_must_span_all_who_fly(make_swarm, without, reason):
    assert refusal(make_swarm(EDGES), without) == reason


def test_with_an_auction_links_must_be_left_between_all_followers(make_swarm):
    loop = {"graph.edges": [[0, 1], [0, 2], [0, 3], [0, 4], [1, 2], [2, 3], [3, 4], [4, 1]]}
    assert refusal(make_swarm(loop), (3,)) == ""
    auctioned = make_swarm({**loop, "formation.assignment": "auction"})
    assert refusal(auctioned, ()) == ""
    reason = "--without 3: no links are left from uav2 to uav1, which assignment = 'auction' needs"
    assert refusal(auctioned, (3,)) == reason


def test_lost_neighbours_and_the_new_bounds_are_reported(make_swarm):
    loses, lemma = consequences(make_swarm(EDGES), (3,))
    assert loses == "uav4 loses uav3 and receives only from uav2"
    before, after = (float(part.split()[-1]) for part in lemma.split(",")[0].split(" -> "))
    assert 0.0 < before < after  # a shorter chain settles sooner
    assert lemma.endswith("the places of uav3 stay empty")
    assert list(consequences(make_swarm(EDGES), ())) == []
