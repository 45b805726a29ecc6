"""The place of a follower in the formation, by its report."""

from flockwire_core.domain.order import Mission
from flockwire_core.domain.vector import add
from flockwire_core.wire.status import Report
from flockwire_operator.places import Places

NOW = 1_790_000_000_000_000_000
LEADER = (1.0, 2.0, 3.0)


def test_the_place_of_an_auction_is_the_reported_one(make_swarm):
    edges = [[0, 1], [1, 2], [2, 3], [3, 4], [4, 1]]
    row = {"kind": "line", "spacing": 0.9}
    swarm = make_swarm({"graph.edges": edges, "formation.assignment": "auction", "formations": {"row": row}})
    places, order = Places(swarm), Mission(NOW, "world", "start", NOW)

    def place(mission, held, number=2, leader=LEADER):
        return places.place(number, Report("formation", mission=mission, place=held), leader, NOW)

    assert place(order, 3) == add(LEADER, swarm.build_formation("").offset(3, 0.0))
    assert place(order._replace(formation="row"), 3) == add(LEADER, swarm.build_formation("row").offset(1, 0.0))
    assert place(order, None) is None
    assert place(order, 4) is None
    assert place(None, 3) is None
    assert place(order._replace(verb="hold"), 3) is None
    assert place(order._replace(formation="unknown"), 3) is None
    assert place(order, 3, number=0) is None
    assert place(order, 3, leader=None) is None
