from flockwire.domain.body import Body, BodyKind
from flockwire.pilot.surroundings import known_bodies
from flockwire.swarm.tables import Obstacle


def test_known_bodies_are_neighbours_and_mapped_obstacles():
    obstacle = Obstacle(center=(2.0, 0.0, 0.0), radius=0.3, height=0.5)
    drone, cylinder = known_bodies((1.0, 0.0, 1.0), [(1.0, 1.0, 1.0)], [obstacle])
    assert drone == Body(BodyKind.DRONE, (0.0, 1.0, 0.0), 0.0)
    assert cylinder == Body(BodyKind.OBSTACLE, (1.0, 0.0, -0.5), 0.3)
