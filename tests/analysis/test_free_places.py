"""A formation passes an obstacle: who makes room is not judged meanwhile, who is away without need is."""

from math import exp

import pytest
from flockwire_analysis.collecting import Collector
from flockwire_analysis.free_places import undisturbed
from flockwire_analysis.phases import Span
from flockwire_analysis.tracking import formation_errors, largest_tail
from flockwire_core.domain.order import Mission
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND
from flockwire_core.wire.keys import MISSION, Key

T0 = 1_790_000_000 * SECOND
END = 50.0  # s
SPEED, SPACING = 0.2, 0.6  # m/s along X, m between the places, along Y
PASSES = 35.0  # s, when the place of uav1 is in the middle of the obstacle
OBSTACLE = {"center": [SPEED * PASSES, SPACING, 0.0], "radius": 0.4}
ROUND, ROOM = 0.7, 0.43  # m from the middle of the obstacle, and between drones


def aside(t, duration=2.0):
    """Return how far uav1 goes aside for the obstacle, and how far uav2 makes room for it, and uav3 for uav2."""
    first = ROUND * exp(-(((t - PASSES) / duration) ** 2))
    second = max(0.0, first + ROOM - SPACING)
    return first, second, max(0.0, second + ROOM - SPACING)


@pytest.fixture
def tail(make_swarm, tmp_path):
    """Return a function from how far each of three followers is aside at t s to the error in the tail that counts."""

    def judge(ways, obstacles=(OBSTACLE,), speed=1.0):
        swarm = make_swarm({
            "formation": {"kind": "expression", "x": "0", "y": f"{SPACING} * (i + 1)"},
            "leader.trajectory.velocity": [SPEED, 0.0, 0.0],
            "graph.edges": [[0, 1], [1, 2], [2, 3]],
            "limits": {"speed": speed, "vertical_speed": 0.3},
            "drones": [{"id": i, "start": [0.0, float(i), 0.0]} for i in range(4)],
            "obstacles": list(obstacles),
        })  # fmt: skip
        collector = Collector(swarm, {})
        order = Mission(T0 - SECOND, "world", "start", T0)
        collector.add("operator", MISSION, order, 0, order.stamp, order.stamp)
        for k in range(round(20 * END) + 1):
            t, stamp = k / 20, T0 + k * SECOND // 20
            for i, way in enumerate((0.0, *ways(t))):
                pose = Pose(stamp, "world", (SPEED * t, SPACING * i + way, 1.0))
                collector.add(i, Key("truth", f"uav{i}"), pose, k, stamp, stamp)
        trace = collector.trace(tmp_path)
        errors = formation_errors(trace)
        phase, settled = (Span(T0 + int(begin * SECOND), T0 + int(END * SECOND)) for begin in (0.0, 5.0))
        return largest_tail(errors, undisturbed(trace, errors), phase, settled)

    return judge


def test_the_way_round_an_obstacle_counts_for_nobody_who_must_make_room(tail):
    assert aside(PASSES) == pytest.approx((0.7, 0.53, 0.36))
    assert tail(aside) < 1e-3


def test_the_same_ways_without_an_obstacle_count(tail):
    assert tail(aside, obstacles=()) == pytest.approx(0.7)


@pytest.mark.parametrize("stays", [0, 1, 2])
def test_who_does_not_come_back_is_judged(tail, stays):
    def ways(t):
        return [way if i != stays else aside(min(t, PASSES))[i] for i, way in enumerate(aside(t))]

    assert tail(ways) == pytest.approx(aside(PASSES)[stays])


def test_two_that_have_each_other_s_place_excuse_nobody(tail):
    assert tail(lambda t: (0.0, SPACING, -SPACING)) == pytest.approx(SPACING)


def test_the_way_back_takes_the_time_that_the_speed_limit_leaves(tail):
    """Away within 10 s and back in as many: at 0.8 m/s to spare that is too slow, at 0.2 m/s it is not."""
    assert tail(lambda t: aside(t, 6.0)) > 0.1
    assert tail(lambda t: aside(t, 6.0), speed=0.4) < 0.1


def test_a_place_that_is_taken_in_the_whole_tail_is_judged_by_the_time_before(tail):
    """Obstacles in a row, from 31 s to the end; the tail begins at 35 s."""
    row = [{"center": [SPEED * t, SPACING, 0.0], "radius": 0.4} for t in range(36, 54, 2)]
    assert tail(lambda t: aside(min(t, PASSES)), obstacles=row) < 0.1
    assert tail(lambda t: aside(t + 15.0), obstacles=row) == pytest.approx(0.7)
