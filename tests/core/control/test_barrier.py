from __future__ import annotations

from math import dist, hypot, inf

import pytest
from flockwire_core.control.barrier import (
    approach_speed,
    keep_clear,
    keep_inside,
    nearest_on_segment,
    sight_speed,
    speed_and_acceleration,
)
from flockwire_core.domain.vector import ZERO
from hypothesis import given
from hypothesis import strategies as st

coordinate = st.floats(-3.0, 3.0)
vector = st.tuples(coordinate, coordinate, coordinate)


@given(st.floats(0.001, 5.0), st.floats(0.5, 20.0), st.floats(0.5, 20.0))
def test_a_gap_that_shrinks_as_fast_as_allowed_never_closes(gap: float, rate: float, braking: float) -> None:
    """Sampled at 100 Hz; and the speed never falls faster than the brakes can."""
    dt, before = 0.01, approach_speed(gap, rate, braking)
    for _ in range(300):
        gap -= dt * approach_speed(gap, rate, braking)
        assert gap >= 0.0
        now = approach_speed(gap, rate, braking)
        assert (before - now) / dt <= braking * (1.0 + rate * dt)
        before = now


def test_both_branches_meet() -> None:
    knee = 10.0 / 25.0
    assert approach_speed(knee + 1e-9, 5.0, 10.0) == pytest.approx(approach_speed(knee, 5.0, 10.0), abs=1e-6)


@given(vector, vector)
def test_no_point_of_the_segment_is_nearer(start: tuple[float, ...], end: tuple[float, ...]) -> None:
    nearest = hypot(*nearest_on_segment(start, end))
    for k in range(11):
        point = [a + k / 10 * (b - a) for a, b in zip(start, end, strict=True)]
        assert nearest <= hypot(*point) + 1e-9


def least(own: float, other: float, *, shared: bool = True, distance: float = 1.0) -> float:
    """Return the least velocity away from a body at `distance`, 2/s x (distance − 0.5 m) = A; both closing speeds."""
    z = (distance, 0.0, 0.0)
    space = keep_clear(z, z, (-own, 0.0, 0.0), (other, 0.0, 0.0), shared, 0.5, 2.0, inf, 9.0)
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
    space = keep_clear(separation, stopping, ZERO, ZERO, False, safe, rate, inf, 1e9)
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


def test_a_box_leaves_out_the_faces_that_are_far() -> None:
    box = ((0.0, 0.0, 0.0), (10.0, 10.0, 10.0))
    assert keep_inside((5.0, 5.0, 5.0), (5.0, 5.0, 5.0), *box, 5.0, inf, 3.0) == []
    (space,) = keep_inside((5.0, 5.0, 5.0), (9.9, 5.0, 5.0), *box, 5.0, inf, 3.0)
    assert space == pytest.approx((-1.0, 0.0, 0.0, -0.5))
    (space,) = keep_inside((-0.2, 5.0, 5.0), (5.0, 5.0, 5.0), *box, 5.0, inf, 3.0)
    assert space == pytest.approx((1.0, 0.0, 0.0, 1.0))  # outside: come back


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize(("place", "normal"), [(0.1, 1.0), (9.9, -1.0)], ids=["low", "high"])
def test_each_face_is_a_wall(axis: int, place: float, normal: float) -> None:
    position = tuple(place if k == axis else 5.0 for k in range(3))
    (space,) = keep_inside(position, position, (0.0, 0.0, 0.0), (10.0, 10.0, 10.0), 5.0, inf, 3.0)
    assert space == pytest.approx((*(normal if k == axis else 0.0 for k in range(3)), -0.5))


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


def test_a_larger_sensing_radius_allows_a_higher_speed() -> None:
    speed = sight_speed(1.5, 0.4, 0.35, 5.0)
    assert 2.0 * speed * 0.35 + speed**2 / 5.0 == pytest.approx(1.1)
    assert sight_speed(0.3, 0.4, 0.35, 5.0) == 0.0
    assert sight_speed(inf, 0.4, 0.35, 5.0) == inf
