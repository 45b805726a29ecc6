import pytest
from flockwire_core.control.observer import (
    ObserverParameters,
    explicit_step,
    implicit_step,
    rate_estimate,
    relay_step,
    signed_power,
)
from flockwire_core.domain.motion import LeaderMotion
from flockwire_core.domain.vector import distance
from hypothesis import given
from hypothesis import strategies as st

PAPER = ObserverParameters(gain=3.0, exponent=1.5)
coordinates = st.floats(-100.0, 100.0)
vectors = st.tuples(coordinates, coordinates, coordinates)
neighbourhoods = st.lists(st.tuples(st.floats(0.1, 10.0), vectors), min_size=1, max_size=5)
parameters = st.builds(ObserverParameters, st.floats(0.01, 100.0), st.floats(1.01, 5.0))
time_steps = st.floats(1e-4, 1.0)


def averaged(neighbour_estimates):
    degree = sum(w for w, _ in neighbour_estimates)
    return degree, tuple(sum(w * eta[k] for w, eta in neighbour_estimates) / degree for k in range(3))


def test_signed_power():
    assert signed_power(-4.0, 1.5) == -8.0
    assert signed_power(4.0, 1.5) == 8.0
    assert signed_power(0.0, 1.5) == 0.0


@pytest.mark.parametrize("step", [explicit_step, implicit_step])
def test_without_neighbours_the_estimate_stays(step):
    assert step((1.0, -2.0, 3.0), [], PAPER, 0.01) == (1.0, -2.0, 3.0)


@pytest.mark.parametrize("step", [explicit_step, implicit_step])
def test_consensus_is_an_equilibrium(step):
    assert step((1.0, -2.0, 3.0), [(1.0, (1.0, -2.0, 3.0))], PAPER, 0.01) == (1.0, -2.0, 3.0)


@given(vectors, neighbourhoods, parameters, time_steps)
def test_the_implicit_step_never_overshoots_consensus(estimate, neighbour_estimates, gains, dt):
    moved = implicit_step(estimate, neighbour_estimates, gains, dt)
    _, average = averaged(neighbour_estimates)
    for before, after, target in zip(estimate, moved, average, strict=True):
        assert min(before, target) - 1e-9 <= after <= max(before, target) + 1e-9


@given(vectors, neighbourhoods, parameters, time_steps)
def test_the_implicit_step_solves_the_proximal_equation(estimate, neighbour_estimates, gains, dt):
    moved = implicit_step(estimate, neighbour_estimates, gains, dt)
    degree, average = averaged(neighbour_estimates)
    for before, after, target in zip(estimate, moved, average, strict=True):
        expected = max(abs(before - target) - dt * gains.gain, 0.0)
        z = abs(after - target)
        # An error of 1e-9 m in z, which is rounding at 100 m, is all that the equation may be off by.
        slope = 1.0 + dt * gains.gain * gains.exponent * degree**gains.exponent * (z + 1e-9) ** (gains.exponent - 1.0)
        assert abs(z + dt * gains.gain * (degree * z) ** gains.exponent - expected) <= 1e-9 * slope


@given(st.tuples(*[st.floats(0.5, 3.0)] * 3), st.tuples(*[st.booleans()] * 3), st.floats(0.2, 2.0), st.floats(1.1, 2.0))
def test_the_implicit_step_agrees_with_the_explicit_one_as_the_step_shrinks(errors, signs, weight, exponent):
    estimate = tuple(error if sign else -error for error, sign in zip(errors, signs, strict=True))
    gains = ObserverParameters(gain=3.0, exponent=exponent)
    heard = [(weight, (0.0, 0.0, 0.0))]
    for dt in (1e-3, 1e-4, 1e-5):
        difference = distance(implicit_step(estimate, heard, gains, dt), explicit_step(estimate, heard, gains, dt))
        assert difference <= 5e4 * dt**2


def chain_after(step, hops, seconds, dt=0.01):
    """Return the estimates of a chain whose leader moves at 0.1 m/s along X, with the leader's position."""
    estimates = [(5.0 - k, float(k), -1.0) for k in range(hops)]
    for k in range(round(seconds / dt)):
        leader = (0.1 * k * dt, 0.0, 0.0)
        heard = [leader, *estimates[:-1]]
        estimates = [step(own, [(1.0, other)], PAPER, dt) for own, other in zip(estimates, heard, strict=True)]
    return estimates, leader


def test_a_chain_finds_the_leader_without_chatter():
    estimates, leader = chain_after(implicit_step, hops=4, seconds=10.0)
    assert max(distance(estimate, leader) for estimate in estimates) < 0.005
    chattering, leader = chain_after(explicit_step, hops=4, seconds=10.0)
    assert max(distance(estimate, leader) for estimate in chattering) > 0.02


def test_the_rate_estimate_is_the_backward_euler_step_of_its_filter():
    velocity, time_constant, dt = (0.0, 0.0, 0.0), 0.15, 0.01
    for k in range(300):
        position, following = (0.2 * k * dt, -0.1 * k * dt, 0.0), (0.2 * (k + 1) * dt, -0.1 * (k + 1) * dt, 0.0)
        velocity = rate_estimate(velocity, position, following, dt, time_constant)
        if k == 14:
            assert velocity[0] == pytest.approx(0.2 * (1 - (0.15 / 0.16) ** 15))
    assert velocity == pytest.approx((0.2, -0.1, 0.0), abs=1e-6)


def test_the_rate_estimate_without_a_filter_is_the_rate():
    assert rate_estimate((9.0, 9.0, 9.0), (0.0, 0.0, 0.0), (0.01, 0.0, -0.02), 0.01, 0.0) == pytest.approx((1, 0, -2))


def test_an_estimate_that_is_near_takes_over_what_it_receives() -> None:
    neighbour = LeaderMotion((1.0, 0.0, 0.0), (0.1, 0.0, 0.0), (0.0, 0.2, 0.0))
    assert relay_step(LeaderMotion((0.99, 0.0, 0.0)), [(2.0, neighbour)], PAPER, 0.01) == neighbour


def test_several_neighbours_are_averaged_by_weight() -> None:
    a, b = LeaderMotion((1.0, 0.0, 0.0), (1.0, 0.0, 0.0)), LeaderMotion((1.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    stepped = relay_step(LeaderMotion((1.0, 0.0, 0.0)), [(3.0, a), (1.0, b)], PAPER, 0.01)
    assert stepped.velocity == pytest.approx((0.75, 0.0, 0.0))


def test_without_neighbours_it_coasts() -> None:
    own = LeaderMotion((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (9.0, 9.0, 9.0))
    assert relay_step(own, [], PAPER, 0.1).position == pytest.approx((0.1, 0.0, 0.0))
