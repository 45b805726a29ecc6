"""How far followers are from their places, as the search judges it."""

from flockwire.wire.plan import Plan
from flockwire_sim.search.formation import PLACELESS, errors
from flockwire_sim.search.record import Recorder
from flockwire_sim.world import World

AUCTION = {
    "control.law": "extended",
    "graph.edges": [[0, 1], [1, 2], [2, 1], [2, 3], [3, 2], [3, 4], [4, 3]],
    "formation": {"kind": "circle", "radius": 1.5, "assignment": "auction"},
}
STARTS = ((0.0, 0.0), (0.6, -2.3), (-2.8, 0.9), (-0.7, 2.6), (2.9, -0.8))  # none near the place of its rank


def test_a_follower_is_judged_by_the_place_that_it_holds_by_the_auction(make_swarm):
    swarm = make_swarm(AUCTION | {f"drones.{i}.start": [*start, 0.0] for i, start in enumerate(STARTS)})
    recorder = Recorder(Plan(swarm.in_simulation()), lambda: None)
    World(swarm, 0, 7.0, (), recorder.take).run()
    _, start = recorder.starts[-1]
    late = errors(recorder, swarm, start, recorder.landing)
    assert len(late) == 4
    assert max(late.values()) < 0.05
    assert set(errors(recorder, swarm, start, start.stamp).values()) == {PLACELESS}
