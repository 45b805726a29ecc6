from math import hypot

import pytest
from flockwire.flight.avoidance import known_bodies, repulsion
from flockwire.swarm.tables import Avoidance, Obstacle
from flockwire.wire.messages import Body, BodyKind
from hypothesis import given
from hypothesis import strategies as st

PARAMETERS = Avoidance(drone_influence_radius=0.5, obstacle_influence_radius=0.8)
coordinates = st.floats(-1.0, 1.0)
vectors = st.tuples(coordinates, coordinates, coordinates).filter(lambda v: hypot(*v) > 0.01)
bodies = st.builds(Body, st.sampled_from(BodyKind), vectors, st.floats(0.0, 0.3))


def test_nothing_near_pushes_nothing():
    assert repulsion([], PARAMETERS) == (0.0, 0.0, 0.0)


@given(bodies)
def test_the_gradient_points_towards_the_body_within_its_influence_only(body):
    push = repulsion([body], PARAMETERS)
    reach = 0.5 if body.kind is BodyKind.DRONE else 0.8
    towards = sum(a * b for a, b in zip(push, body.relative_position, strict=True))
    gap = hypot(*body.relative_position) - body.radius
    assert towards >= 0.0
    if gap > reach + 1e-9:
        assert push == (0.0, 0.0, 0.0)
    if gap < reach - 1e-3:
        assert towards > 0.0


@given(st.lists(bodies, max_size=5))
def test_pushes_add_up(several):
    each = [repulsion([body], PARAMETERS) for body in several]
    total = tuple(sum(push[k] for push in each) for k in range(3))
    assert repulsion(several, PARAMETERS) == pytest.approx(total)


def test_known_bodies_are_neighbours_and_mapped_obstacles():
    obstacle = Obstacle(center=(2.0, 0.0, 0.0), radius=0.3, height=0.5)
    drone, cylinder = known_bodies((1.0, 0.0, 1.0), [(1.0, 1.0, 1.0)], [obstacle])
    assert drone == Body(BodyKind.DRONE, (0.0, 1.0, 0.0), 0.0)
    assert cylinder == Body(BodyKind.OBSTACLE, (1.0, 0.0, -0.5), 0.3)
