import pytest
from flockwire_core.control.formation import Circle
from flockwire_core.control.potential import potential_gradient
from flockwire_core.control.protocol import ProtocolParameters, compensation, control_input
from flockwire_core.domain.vector import ZERO, add, distance, norm, scale
from hypothesis import given
from hypothesis import strategies as st

PAPER = ProtocolParameters(formation_gain=3.0, compensation_gain=0.2, compensation_smoothing=0.01)
coordinates = st.floats(-1e3, 1e3)
vectors = st.tuples(coordinates, coordinates, coordinates)


@given(vectors, st.floats(0.0, 10.0), st.floats(1e-3, 1.0))
def test_the_compensation_is_bounded_by_phi_and_points_along_the_error(error, gain, smoothing):
    f = compensation(error, ProtocolParameters(3.0, gain, smoothing))
    assert norm(f) <= gain
    assert sum(a * b for a, b in zip(error, f, strict=True)) >= 0.0


def test_the_compensation_is_smooth_at_zero():
    assert compensation(ZERO, PAPER) == ZERO
    assert compensation((0.01, 0.0, 0.0), PAPER) == pytest.approx((0.1, 0.0, 0.0))


def test_equation_9_by_hand():
    u = control_input(
        position=(3.0, 0.0, 1.0),
        offset=(1.0, 0.0, 0.0),
        offset_rate=(0.0, -0.5, 0.0),
        leader_estimate=(1.0, 0.0, 1.0),
        repulsion=(0.0, 0.25, 0.0),
        parameters=PAPER,
    )
    assert u == pytest.approx((-3.0 - 0.2 / 1.01, -0.75 - 0.5, 0.0))


@given(vectors, vectors, vectors)
def test_in_formation_only_the_offset_rate_remains(offset, offset_rate, leader):
    u = control_input(add(offset, leader), offset, offset_rate, leader, ZERO, PAPER)
    assert distance(u, offset_rate) < 1e-9


def test_a_follower_that_knows_its_leader_settles_within_the_papers_residual():
    circle, dt, velocity = Circle(count=4, radius=2.0, rate=1.0), 0.01, (0.1, 0.1, 0.0)
    position = (-1.0, 3.0, 0.0)
    for k in range(1000):
        t = k * dt
        leader = scale(velocity, t)
        u = control_input(position, circle.offset(0, t), circle.offset_rate(0, t), leader, ZERO, PAPER)
        position = add(position, scale(u, dt))
    assert distance(position, add(circle.offset(0, 10.0), scale(velocity, 10.0))) < 0.025


def test_repulsion_drives_two_followers_apart():
    separation = (0.1, 0.0, 0.0)
    gradient = potential_gradient(separation, 0.3, 0.5)
    assert control_input(ZERO, ZERO, ZERO, ZERO, gradient, PAPER)[0] > 0
