"""How far followers are from their places, as the search judges it."""

from math import exp

import pytest
from flockwire_core.domain.order import Mission
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND
from flockwire_core.wire.keys import ROWS, Key
from flockwire_core.wire.plan import Plan
from flockwire_lab.network import Sample
from flockwire_lab.process import Published
from flockwire_lab.search.formation import PLACELESS, errors
from flockwire_lab.search.record import Recorder
from flockwire_lab.world import EPOCH, World

AUCTION = {
    "control.law": "extended",
    "graph.edges": [[0, 1], [1, 2], [2, 1], [2, 3], [3, 2], [3, 4], [4, 3]],
    "formation": {"kind": "circle", "radius": 1.5, "assignment": "auction"},
}
STARTS = ((0.0, 0.0), (0.6, -2.3), (-2.8, 0.9), (-0.7, 2.6), (2.9, -0.8))  # none near the place of its rank


@pytest.mark.long
def test_a_follower_is_judged_by_the_place_that_it_holds_by_the_auction(make_swarm):
    swarm = make_swarm(AUCTION | {f"drones.{i}.start": [*start, 0.0] for i, start in enumerate(STARTS)})
    recorder = Recorder(Plan(swarm.in_simulation()))
    World(swarm, 0, 7.0, (), recorder.take).run()
    _, start = recorder.starts[-1]
    late, early = [errors(recorder, swarm, start, at, at).values() for at in (recorder.landing, start.stamp)]
    assert len(late) == 4
    assert max(error.values[-1] for error in late) < 0.05
    assert {error.values[-1] for error in early} == {PLACELESS}


def published(key, message, stamp):
    sample = Sample(ROWS[key.kind], message, 0, stamp, b"", False)
    return Published(stamp, key, "", sample)


@pytest.mark.parametrize(("back", "judged"), [(True, set()), (False, {"uav3"})])
def test_who_makes_room_at_an_obstacle_is_not_judged_unless_he_stays_away(make_swarm, back, judged):
    """The place of uav1 passes an obstacle at 20 s, so that it flies aside; uav2 makes room, and uav3 for uav2."""
    swarm = make_swarm({
        "formation": {"kind": "expression", "x": "0", "y": "0.6 * (i + 1)"},
        "leader.trajectory.velocity": [0.2, 0.0, 0.0],
        "graph.edges": [[0, 1], [1, 2], [2, 3]],
        "drones": [{"id": i, "start": [0.0, float(i), 0.0]} for i in range(4)],
        "obstacles": [{"center": [4.0, 0.6, 0.0], "radius": 0.4}],
    })  # fmt: skip
    start, end = Mission(EPOCH, "world", "start", EPOCH), 20.0 if back else 35.0
    recorder = Recorder(Plan(swarm.in_simulation()))
    for k in range(round(20 * end) + 1):
        t, stamp = k / 20, EPOCH + k * SECOND // 20
        way, late = (exp(-(((at - 20.0) / 2.0) ** 2)) for at in (t, min(t, 20.0)))
        for i, y in enumerate((0.0, 0.6 + 0.7 * way, 1.2 + 0.53 * way, 1.8 + 0.36 * late)):
            pose = Pose(stamp, "world", (0.2 * t, y, 1.0))
            recorder.take(published(Key("truth", f"uav{i}"), pose, stamp))
    now = EPOCH + round(end * SECOND)
    late = errors(recorder, swarm, start, now - SECOND, now)
    assert {owner for owner, error in late.items() if error.values.max() > 0.1} == judged
