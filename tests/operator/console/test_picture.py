"""The data of the page: where the place of a follower is drawn."""

from flockwire_core.domain.order import Mission
from flockwire_core.domain.time import SECOND
from flockwire_core.wire.status import Report, Status
from flockwire_operator.console.picture import snapshot
from flockwire_operator.places import Places

NOW = 1_790_000_000 * SECOND


def test_the_place_of_a_follower_is_the_one_that_it_holds_by_the_auction(make_plan):
    edges = [[0, 1], [1, 2], [2, 3], [3, 4], [4, 1]]
    plan = make_plan({"graph.edges": edges, "formation.assignment": "auction", "formation.rate": 0.0})
    order, leader = Mission(NOW, "world", "start", NOW), (1.0, 2.0, 1.0)

    def drawn(place):
        reports = {"leader": Report("formation", position=leader)}
        reports["uav2"] = Report("formation", mission=order, place=place)
        statuses = {
            name: Status(NOW, "world", name, report, 0, 0, 0, 0, 0, 0.0, 0, (), ()) for name, report in reports.items()
        }
        return snapshot(plan, Places(plan.swarm), statuses, NOW)["drones"][2]["place"]

    x, y, z = plan.swarm.build_formation().offset(3, 0.0)
    assert drawn(3) == [round(1.0 + x, 3), round(2.0 + y, 3), 1.0 + z]
    assert drawn(None) is None
