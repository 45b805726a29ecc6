from math import hypot

import pytest
from flockwire_core.control.potential import PotentialParameters, potential_gradient, repulsion
from flockwire_core.domain.body import Body, BodyKind
from flockwire_core.domain.vector import ZERO, norm, scale
from hypothesis import assume, given
from hypothesis import strategies as st

coordinates = st.floats(-1.0, 1.0)
separations = st.tuples(coordinates, coordinates, coordinates)
vectors = separations.filter(lambda v: hypot(*v) > 0.01)
bodies = st.builds(Body, st.sampled_from(BodyKind), vectors, st.floats(0.0, 0.3))
PARAMETERS = PotentialParameters(0.3, 0.5, 0.5, 0.8)
gains, radii = st.floats(0.1, 2.0), st.floats(0.3, 2.0)


def potential(distance, gain, radius):
    return 0.5 * gain * (1.0 / distance - 1.0 / radius) ** 2 if distance < radius else 0.0


@given(separations, gains, radii)
def test_the_gradient_is_the_numerical_derivative(separation, gain, radius):
    distance = norm(separation)
    assume(distance > 0.1)
    step = 1e-6
    # Where the step straddles the edge of the influence the difference is of second order; the tolerance covers it.
    for axis in range(3):
        ahead, behind = list(separation), list(separation)
        ahead[axis] += step
        behind[axis] -= step
        rise = potential(norm(tuple(ahead)), gain, radius) - potential(norm(tuple(behind)), gain, radius)
        slope = rise / (2 * step)
        assert potential_gradient(separation, gain, radius)[axis] == pytest.approx(slope, rel=1e-4, abs=1e-3)


@given(separations, gains, radii)
def test_the_negative_gradient_pushes_away_within_the_influence_radius_only(separation, gain, radius):
    gradient = potential_gradient(separation, gain, radius)
    distance = norm(separation)
    if 1e-3 < distance < 0.999 * radius:
        away = scale(separation, norm(gradient) / distance)
        assert scale(gradient, -1.0) == pytest.approx(away, rel=1e-9, abs=1e-12)
        assert norm(gradient) > 0
    if distance >= radius:
        assert gradient == ZERO


def test_a_value():
    assert potential_gradient((0.0, 0.25, 0.0), 0.3, 0.5) == pytest.approx((0.0, -0.3 * 2 * 16, 0.0))


@pytest.mark.parametrize("separation", [ZERO, (1e-200, 0.0, 0.0), (5e-324, 0.0, 0.0)])
def test_coincident_bodies_have_no_direction(separation):
    assert potential_gradient(separation, 1.0, 0.5) == ZERO


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
