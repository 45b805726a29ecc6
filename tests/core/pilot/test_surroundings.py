import pytest
from flockwire_core.domain.body import Body, BodyKind, Nearby
from flockwire_core.domain.pose import Pose
from flockwire_core.pilot.surroundings import Surroundings, known_bodies
from flockwire_core.swarm.tables import Obstacle


def test_known_bodies_are_neighbours_and_mapped_obstacles():
    obstacle = Obstacle(center=(2.0, 0.0, 0.0), radius=0.3, height=0.5)
    drone, cylinder = known_bodies((1.0, 0.0, 1.0), [(1.0, 1.0, 1.0)], [obstacle])
    assert drone == Body(BodyKind.DRONE, (0.0, 1.0, 0.0), 0.0)
    assert cylinder == Body(BodyKind.OBSTACLE, (1.0, 0.0, -0.5), 0.3)


def test_what_was_seen_from_an_earlier_place_stays_where_it_is():
    surroundings = Surroundings(sensing=True, obstacles=())
    surroundings.take_nearby(Nearby(1, "world", (Body(BodyKind.DRONE, (1.0, 0.5, 0.0), 0.0),)))
    places = [
        pose.position[k] + body.relative_position[k]
        for pose in (Pose(1, "world", (0.0, 0.0, 1.0)), Pose(2, "world", (0.3, -0.1, 1.1)))
        for body in surroundings.bodies(pose, list)
        for k in range(3)
    ]
    assert places == pytest.approx([1.0, 0.5, 1.0] * 2)
