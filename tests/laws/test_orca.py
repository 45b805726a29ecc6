"""Reciprocal avoidance: half-planes leave the velocity obstacles, and drones that change places keep apart."""

from math import cos, dist, pi, sin

import numpy as np
import pytest
from flockwire_core.domain.body import Body, BodyKind
from flockwire_laws.orca import Orca
from flockwire_laws.velocity_obstacle import half_plane
from law_flights import Flight, at, graph, rate

HORIZON = 2.0  # s


def test_a_velocity_into_a_body_within_the_horizon_is_outside_its_half_plane():
    body = Body(BodyKind.OBSTACLE, (2.0, 0.3, 0.0), 0.2, (0.0, 0.0, 0.0))
    towards, away = (1.5, 0.0, 0.0), (-0.5, 0.0, 0.0)
    nx, ny, _, bound = half_plane(towards, body, 0.6, 1.0, HORIZON)
    assert nx * towards[0] + ny * towards[1] < bound
    new = (towards[0] + (bound - nx * towards[0]) * nx, (bound - nx * towards[0]) * ny)  # on the plane: it just passes
    passes = min(dist((2.0, 0.3), (t / 100 * new[0], t / 100 * new[1])) for t in range(round(100 * HORIZON) + 1))
    assert passes == pytest.approx(0.6, abs=0.02)
    nx, ny, _, bound = half_plane(away, body, 0.6, 1.0, HORIZON)
    assert nx * away[0] + ny * away[1] >= bound


@pytest.mark.parametrize("count", [2, 4])
def test_drones_change_places_without_coming_too_near(count):
    angles = {i + 1: 2.0 * pi * i / count for i in range(count)}
    starts = {i: (1.5 * cos(a) + 0.05 * i, 1.5 * sin(a), 0.0) for i, a in angles.items()}
    places = {i: (-1.5 * cos(a), -1.5 * sin(a), 0.0) for i, a in angles.items()}
    leader = {0: at((0.0, 0.0, 9.0))}  # far above: no body in the way
    lowered = {i: (x, y, -9.0) for i, (x, y, _) in places.items()}
    flight = Flight(Orca, starts, [(0, i, 1.0) for i in starts], lowered, leader)
    flight.laws = {i: Planar(law) for i, law in flight.laws.items()}

    def nearest(f):
        return min(dist(p[:2], q[:2]) for i, p in f.p.items() for j, q in f.p.items() if i < j)

    assert flight.fly(15.0, nearest).min() > 0.4
    assert flight.array[:, :2] == pytest.approx(np.array(list(places.values()))[:, :2], abs=0.02)


class Planar:
    """The law without the leader as a body, and at most 1 m/s."""

    def __init__(self, law):
        self._law = law
        law._settings = law._settings._replace(speed=1.0)

    def step(self, observation):
        bodies = [one for one in observation.bodies if one.relative_position[2] < 5.0]
        decision = self._law.step(observation._replace(bodies=bodies))
        x, y, _ = decision.command
        return decision._replace(command=(x, y, 0.0))


def test_alone_its_error_falls_at_the_rate_that_check_predicts():
    edges = [(0, 1, 1.0)]
    assert Orca.check(graph((1,), edges), {}, {}) == ([], [], {"slowest": 3.0})
    flight = Flight(Orca, {1: (2.0, 1.0, 0.0)}, edges, {1: (1.0, 0.0, 0.0)}, {0: at((0.0, 0.0, 0.0))})
    errors = flight.fly(1.5, lambda f: dist(f.p[1], (1.0, 0.0, 0.0)))
    assert rate(errors, 0.01, 0.2, 1.2) == pytest.approx(3.0, rel=0.05)
