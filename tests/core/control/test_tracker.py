from __future__ import annotations

from random import Random

import pytest
from flockwire_core.control.tracker import AccelerationTracker, BodyTracks, VelocityTracker

HERE, THERE = (0.0, 0.0, 0.0), (1.0, 0.0, 0.0)


def test_a_straight_flight_is_known_from_the_second_position_on() -> None:
    tracker = VelocityTracker(0.1, (0.0, 1.0, 2.0), 10.0)
    for k in range(1, 50):
        tracker.update((0.3 * k * 0.01, 1.0 - 0.1 * k * 0.01, 2.0), 10.0 + k * 0.01)
        assert tracker.velocity == pytest.approx((0.3, -0.1, 0.0), abs=1e-9)


def test_an_accelerating_body_is_seen_as_late_as_the_equation_says() -> None:
    tracker, dt = VelocityTracker(0.1, (0.0, 0.0, 0.0), 0.0), 0.001
    for k in range(1, 3000):
        tracker.update((0.5 * 2.0 * (k * dt) ** 2, 0.0, 0.0), k * dt)
    assert tracker.velocity[0] == pytest.approx(2.0 * 2.999 - 2 * 2.0 * 0.1, rel=0.01)


def test_constant_acceleration_is_tracked_exactly() -> None:
    tracker, dt = AccelerationTracker(0.1, (0.0, 0.0, 0.0), 0.0), 0.01
    for k in range(1, 500):
        tracker.update((0.25 * (k * dt) ** 2, 0.0, 1.0), k * dt)
    assert tracker.acceleration == pytest.approx((0.5, 0.0, 0.0), abs=1e-6)
    assert tracker.velocity == pytest.approx((0.5 * 4.99, 0.0, 0.0), abs=1e-6)


def test_old_positions_are_left_out() -> None:
    tracker = VelocityTracker(0.1, (0.0, 0.0, 0.0), 1.0)
    tracker.update((5.0, 0.0, 0.0), 0.9)
    assert tracker.position == (0.0, 0.0, 0.0)


def test_bodies_keep_their_velocities_whatever_their_order() -> None:
    draw, tracks = Random(3), BodyTracks(0.05)
    starts = [(0.0, 0.0, 1.0), (0.8, 0.0, 1.0), (0.0, 0.9, 1.0), (1.5, 1.5, 1.0)]
    speeds = [(0.5, 0.1, 0.0), (-0.5, 0.1, 0.0), (0.0, -0.3, 0.0), (0.0, 0.0, 0.0)]
    for k in range(60):
        order = draw.sample(range(4), 4)
        seen = [tuple(x + 0.01 * k * v for x, v in zip(starts[i], speeds[i], strict=True)) for i in order]
        found = tracks.update(seen, 0.01 * k)
        if k > 1:
            for i, velocity in zip(order, found, strict=True):
                assert velocity == pytest.approx(speeds[i], abs=1e-6)


def test_a_body_that_comes_into_sight_is_new_and_one_that_left_is_forgotten() -> None:
    tracks = BodyTracks(0.05)
    for k in range(20):
        tracks.update([(0.01 * k, 0.0, 0.0)], 0.01 * k)
    first, second = tracks.update([(5.0, 0.0, 0.0), (0.2, 0.0, 0.0)], 0.2)
    assert first == (0.0, 0.0, 0.0)
    assert second == pytest.approx((1.0, 0.0, 0.0), abs=1e-6)
    assert tracks.update([], 0.21) == []


def moving(tracks: BodyTracks, begin: float) -> list[tuple[float, float, float]]:
    """Let one body move at 0.5 m/s for a second from `begin` on; return what was seen last."""
    seen = []
    for k in range(101):
        seen = tracks.update([(0.005 * k, 0.0, 0.0)], begin + 0.01 * k)
    return seen


def test_a_body_that_moves_steadily_is_seen_to() -> None:
    assert moving(BodyTracks(0.05), 0.0)[0] == pytest.approx((0.5, 0.0, 0.0), abs=1e-3)


def test_each_body_has_a_velocity_also_where_another_one_has_the_same_stamp() -> None:
    tracks = BodyTracks(0.05)
    assert [len(tracks.update(seen, 1.0)) for seen in ([HERE], [HERE, THERE], [THERE], [])] == [1, 2, 1, 0]
