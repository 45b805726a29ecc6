"""A drone that the tracker has lost stays where it was seen last, for all others, as a cylinder that grows."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from flockwire_core.domain.body import Body, BodyKind
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.swarm.model import Swarm
from flockwire_mocap.field_bodies import FEW, FieldBodies
from flockwire_mocap.lost_body import DRIFT, WAY, drone_spread, person_spread

NOW = 1_790_000_000 * SECOND
PLACE = (1.0, 0.0, 1.4)
LIMITS = {"limits.speed": 2.0, "limits.vertical_speed": 0.7}


@pytest.fixture
def swarm(make_swarm: Callable[..., Swarm]) -> Swarm:
    return make_swarm(LIMITS)


def seen(swarm: Swarm, age: float, position: tuple[float, float, float], place: Any = PLACE) -> tuple[Body, ...]:
    """Return what drone 1 sees from `position` of drone 2, which was seen `age` s ago at `place`."""
    field, now = FieldBodies(swarm), NOW + nanoseconds(age)
    field.see_drone(2, Pose(NOW, "world", place))
    field.see_drone(1, Pose(now, "world", position))
    field.arrange(now)
    return field.near(1, position)


@pytest.mark.parametrize("age", [0.11, 1.0, 1.5, 10.0, 3600.0])
@pytest.mark.parametrize(
    ("position", "relative"),
    [
        ((0.0, 0.0, 1.4), (1.0, 0.0, 0.0)),
        ((1.0, 0.0, 0.5), (0.0, 0.0, 0.0)),
        ((1.0, 0.0, 2.4), (0.0, 0.0, -1.0)),
        ((0.5, 0.0, 0.0), (0.5, 0.0, 0.0)),
    ],
    ids=["beside", "below", "above", "on the ground"],
)
def test_however_long_it_is_not_seen_it_stands_there_from_the_ground_up(
    swarm: Swarm, age: float, position: tuple[float, float, float], relative: tuple[float, float, float]
) -> None:
    (body,) = seen(swarm, age, position)
    assert (body.kind, body.relative_position) == (BodyKind.OBSTACLE, pytest.approx(relative))


def test_until_its_pilot_stops_it_it_is_a_drone_that_gives_way(swarm: Swarm) -> None:
    (body,) = seen(swarm, 0.1, (0.0, 0.0, 1.4))
    assert body == Body(BodyKind.DRONE, (1.0, 0.0, 0.0), 0.0)


def test_from_its_surface_a_drone_keeps_as_far_as_from_a_drone_that_may_be_there(swarm: Swarm) -> None:
    (body,) = seen(swarm, 0.11, (0.0, 0.0, 1.4))
    safe = swarm.avoidance
    may_be_at = drone_spread(swarm, 2, PLACE[2]).reach(0.11)
    assert body.radius + safe.kept.obstacle == pytest.approx(safe.kept.drone + may_be_at)


def test_it_grows_as_far_as_it_flies_blind_then_as_it_drifts_until_it_is_down(make_swarm: Callable[..., Swarm]) -> None:
    swarm = make_swarm({**LIMITS, "airframes": {"kinematics": {"lag": 0.25, "dead_time": 0.05}}})
    spread = drone_spread(swarm, 2, 1.4)  # it stops 0.1 + 0.3 s after it was lost, and is down 1 + 0.3 + 2 s after
    assert [spread.reach(age) for age in (0.2, 0.4, 1.4, 3.3, 4.0, 60.0)] == pytest.approx(
        [0.4, 0.8, 0.8 + DRIFT, 0.8 + 2.9 * DRIFT, 0.8 + 2.9 * DRIFT, 0.8 + 2.9 * DRIFT]
    )
    assert [spread.growth(age) for age in (0.2, 1.0, 3.4)] == [2.0, DRIFT, 0.0]


def test_its_surface_comes_nearer_as_it_grows_from_wherever_it_is_seen(swarm: Swarm) -> None:
    for position in ((0.0, 0.0, 1.0), (1.0, 1.2, 1.0), (1.0, 0.0, 2.6)):
        (body,) = seen(swarm, 0.5, position)
        length = sum(x * x for x in body.relative_position) ** 0.5
        toward_us = tuple(-x / length * DRIFT for x in body.relative_position)
        assert body.velocity == pytest.approx(toward_us)
    assert seen(swarm, 0.5, (1.0, 0.1, 1.0))[0].velocity == (0.0, 0.0, 0.0)
    assert seen(swarm, 60.0, (0.0, 0.0, 1.0))[0].velocity == (0.0, 0.0, 0.0)


def test_one_that_stood_on_the_ground_does_not_grow(swarm: Swarm) -> None:
    near = [seen(swarm, age, (0.0, 0.0, 0.4), (1.0, 0.0, 0.02))[0] for age in (0.2, 100.0)]
    assert near[0] == near[1]
    assert near[0].relative_position == pytest.approx((1.0, 0.0, -0.38))


def test_who_is_not_seen_sees_no_body_where_it_was_itself(swarm: Swarm) -> None:
    field = FieldBodies(swarm)
    field.see_drone(2, Pose(NOW, "world", PLACE))
    field.see_drone(1, Pose(NOW + SECOND, "world", (5.0, 5.0, 1.0)))
    field.arrange(NOW + SECOND)
    assert field.near(2, PLACE) == ()


def test_seen_again_it_is_a_drone_where_it_is(swarm: Swarm) -> None:
    field = FieldBodies(swarm)
    for later, place in ((0, PLACE), (5 * SECOND, (0.5, 0.0, 1.0))):
        field.see_drone(2, Pose(NOW + later, "world", place))
        field.arrange(NOW + later)
    assert field.near(1, (0.0, 0.0, 1.0)) == (Body(BodyKind.DRONE, (0.5, 0.0, 0.0), 0.0),)


def test_in_a_crowd_it_is_found_though_it_has_grown(swarm: Swarm) -> None:
    field, now = FieldBodies(swarm), NOW + 10 * SECOND
    field.see_drone(2, Pose(NOW, "world", (2.0, 0.0, 1.0)))
    for k in range(3, 2 * FEW):
        field.see_drone(k, Pose(now, "world", (50.0 + k, 0.0, 1.0)))
    field.arrange(now)
    (body,) = field.near(1, (0.0, 0.0, 1.0))
    assert 2.0 - body.radius < swarm.avoidance.sensing_radius < 2.0


def test_a_lost_person_moves_a_metre_at_most() -> None:
    for speed in (0.0, 0.5, 1.5):
        spread = person_spread(speed)
        assert spread.reach(0.5) == pytest.approx(max(speed, 0.5) * 0.5)
        assert spread.reach(60.0) == pytest.approx(WAY)
