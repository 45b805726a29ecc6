from __future__ import annotations

from math import dist, hypot, inf
from typing import Any

import pytest
from flockwire_core.control.barrier import (
    Approach,
    keep_clear,
    nearest_on_segment,
    sight_speed,
    speed_and_acceleration,
)
from flockwire_core.control.safety_filter import HalfSpace
from flockwire_core.domain.vector import ZERO, norm, scale
from hypothesis import given
from hypothesis import strategies as st

coordinate = st.floats(-3.0, 3.0)
vector = st.tuples(coordinate, coordinate, coordinate)


def approach(last: tuple[float, ...] = ZERO, rate: float = 5.0, braking: float = inf, speed: float = 9.0) -> Approach:
    return Approach(last, speed, rate, braking)


def slower(v: tuple[float, ...], rate: float, braking: float) -> tuple[float, ...]:
    """Return v 10 ms later: straight braking as quick as the barrier allows."""
    speed = hypot(*v)
    return tuple(x * max(1.0 - 0.01 * min(rate, braking / max(speed, 1e-9)), 0.0) for x in v)


def lack(space: HalfSpace | None, v: tuple[float, ...]) -> float:
    return space[3] - sum(n * x for n, x in zip(space[:3], v, strict=True)) if space is not None else 0.0


@given(st.lists(st.tuples(vector, st.floats(0.0, 2.0)), min_size=1, max_size=6), vector, st.floats(0.5, 20.0))
def test_straight_braking_satisfies_all_that_meet(walls: Any, v: tuple[float, ...], braking: float) -> None:
    """In a corner of any angle, beside any obstacle: no gap closes, and no step needs more than the brakes have."""
    rate, planes = 5.0, [(scale(n, 1.0 / norm(n)), gap) for n, gap in walls if norm(n) > 0.1]
    for _ in range(40):  # as fast as all allow
        if all(lack(approach(v, rate, braking).half_space(n, gap), v) <= 0.0 for n, gap in planes):
            break
        v = scale(v, 0.8)
    else:
        return
    for _ in range(500):
        v = slower(v, rate, braking)
        planes = [(n, gap + 0.01 * sum(p * q for p, q in zip(n, v, strict=True))) for n, gap in planes]
        for n, gap in planes:
            assert gap >= -1e-9
            assert lack(approach(v, rate, braking).half_space(n, gap), slower(v, rate, braking)) <= 0.01 * braking


@pytest.mark.parametrize("speed", [0.5, 2.0, 2.001, 6.0])
def test_straight_ahead_it_needs_the_way_to_brake(speed: float) -> None:
    """Up to b/alpha = 2 m/s at alpha times the way, beyond with b = 10 m/s^2."""
    way = speed / 5.0 if speed <= 2.0 else speed**2 / 20.0 + 0.2
    space = approach((-speed, 0.0, 0.0), braking=10.0).half_space((1.0, 0.0, 0.0), way)
    assert space == pytest.approx((1.0, 0.0, 0.0, -speed))


def test_along_a_wall_it_may_approach_as_fast_as_it_can_stop() -> None:
    """At 6 m/s it takes 0.63 s to stop, half of it in the mean."""
    space = approach((0.0, 6.0, 0.0), braking=10.0).half_space((1.0, 0.0, 0.0), 0.2)
    assert space == pytest.approx((1.0, 0.0, 0.0, -0.2 / (0.3 + 0.2 / 6.0)))


@given(vector, vector)
def test_no_point_of_the_segment_is_nearer(start: tuple[float, ...], end: tuple[float, ...]) -> None:
    nearest = hypot(*nearest_on_segment(start, end))
    for k in range(11):
        point = [a + k / 10 * (b - a) for a, b in zip(start, end, strict=True)]
        assert nearest <= hypot(*point) + 1e-9


def least(own: float, other: float, *, shared: bool = True, distance: float = 1.0) -> float:
    """Return the least velocity away from a body at `distance`, 2/s x (distance − 0.5 m) = A; both closing speeds."""
    z = (distance, 0.0, 0.0)
    space = keep_clear(z, z, (-own, 0.0, 0.0), (other, 0.0, 0.0), shared, 0.5, approach(rate=2.0))
    assert space is not None
    assert space[:3] == (1.0, 0.0, 0.0)
    return space[3]


@pytest.mark.parametrize(
    ("own", "other", "expected"),
    [
        (0.0, 0.0, -0.5),  # both stand: half of A = 1 m/s for each
        (0.5, 0.5, -0.5),  # both come
        (0.2, 0.0, -0.6),  # half of what it is faster
        (0.6, 0.0, -0.7),  # no more than 0.2 A
        (0.0, 0.6, -0.3),  # and so the other one
        (0.0, 1.0, 0.0),  # the other one takes all that there is
        (0.0, 1.3, 0.3),  # and more
        (0.0, -1.0, -0.7),  # it flies away: no reason to follow as fast
    ],
)  # fmt: skip
def test_two_drones_share_what_they_may_approach_by_who_moves(own: float, other: float, expected: float) -> None:
    assert least(own, other) == pytest.approx(expected)


@pytest.mark.parametrize("own", [-0.3, 0.0, 0.3])
def test_two_drones_that_are_too_near_leave_as_if_the_other_did_not(own: float) -> None:
    assert least(own, 0.0, distance=0.4) == pytest.approx(0.2)  # −A
    assert least(own, -0.3, distance=0.4) == pytest.approx(0.1)  # half of it as the other one leaves


def test_a_body_that_does_not_yield_takes_what_it_takes() -> None:
    assert least(0.3, 0.3, shared=False) == pytest.approx(-0.7)


@given(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0), st.floats(0.1, 3.0))
def test_what_two_drones_are_allowed_together_is_never_more_than_a(own: float, other: float, distance: float) -> None:
    together = -least(own, other, distance=distance) - least(other, own, distance=distance)
    assert together <= 2.0 * (distance - 0.5) + 1e-9


@given(vector, vector, st.floats(0.1, 3.0))
def test_one_step_within_the_half_space_keeps_the_whole_way_clear(
    separation: tuple[float, ...], stopping: tuple[float, ...], push: float
) -> None:
    """The discrete guarantee: the way that is still to come and the new stopping point are all beyond r."""
    safe, rate, dt = 0.4, 5.0, 0.01
    z = nearest_on_segment(separation, stopping)
    if hypot(*z) <= safe + 1e-6:
        return
    space = keep_clear(separation, stopping, ZERO, ZERO, False, safe, approach(rate=rate, speed=1e9))
    assert space is not None
    nx, ny, nz, least = space
    u = (least * nx - push * ny, least * ny + push * nx, least * nz)  # as fast as allowed, and sideways
    moved = tuple(p + dt * v for p, v in zip(stopping, u, strict=True))
    along = nx * u[0] + ny * u[1] + nz * u[2]
    if along < least - 1e-9:
        return
    for k in range(11):
        old = [a + k / 10 * (b - a) for a, b in zip(separation, stopping, strict=True)]
        for j in range(11):
            point = [a + j / 10 * (b - a) for a, b in zip(old, moved, strict=True)]
            assert dist(point, (0.0, 0.0, 0.0)) >= safe - 1e-9


@given(vector, st.floats(0.01, 4.0), vector)
def test_ball_and_plane_hold_both_limits(last: tuple[float, ...], change: float, v: tuple[float, ...]) -> None:
    speed = 3.0
    if hypot(*last) > speed:
        return
    centre, radius, plane = speed_and_acceleration(last, speed, change)
    inside = dist(v, centre) <= radius
    if plane is not None:
        inside = inside and sum(a * b for a, b in zip(plane[:3], v, strict=True)) >= plane[3]
    if inside:
        assert hypot(*v) <= speed + 1e-9
        assert dist(v, last) <= change + 1e-9


@given(st.floats(0.0, 3.0), st.floats(0.01, 6.0))
def test_both_ends_of_what_the_limits_leave_are_within_a_step_that_can_stop(pace: float, change: float) -> None:
    speed = 3.0
    if not pace <= change or pace + change <= speed:
        return
    (x, _, _), radius, plane = speed_and_acceleration((pace, 0.0, 0.0), speed, change)
    assert plane is None
    assert x + radius == pytest.approx(speed)
    assert x - radius == pytest.approx(max(pace - change, -speed))


def test_a_larger_sensing_radius_allows_a_higher_speed() -> None:
    speed = sight_speed(1.5, 0.4, 0.35, 5.0, 0.2)
    assert 2.0 * speed * 0.35 + speed**2 / 5.0 == pytest.approx(1.1)
    assert 2.0 * sight_speed(1.5, 0.4, 0.35, 5.0, 0.8) * 0.8 == pytest.approx(1.3)
    assert sight_speed(0.3, 0.4, 0.35, 5.0, 0.2) == 0.0
    assert sight_speed(inf, 0.4, 0.35, 5.0, 0.2) == inf
