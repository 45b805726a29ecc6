"""The bent place: outside the discs, continuous, no faster than allowed; exactly the place without bodies."""

from __future__ import annotations

from itertools import pairwise
from math import dist, hypot
from random import Random

import pytest
from flockwire_core.control.around.bent_place import SPARE, BentPlace, DetourParameters
from flockwire_core.control.fence import Room
from flockwire_core.domain.body import Body, BodyKind, Separation
from flockwire_core.domain.vector import ZERO, Vector, add, subtract
from hypothesis import given, settings
from hypothesis import strategies as st

DT = 0.02
WIDE = Room((-20.0, -20.0, 0.0), (20.0, 20.0, 3.0))
PARAMETERS = DetourParameters(Separation(0.43, 0.33), WIDE, 1.0, 10.0, 0.5)


def passing(
    speed: float, aside: float, radius: float, kind: BodyKind = BodyKind.OBSTACLE, room: Room = WIDE
) -> list[tuple[Vector, Vector, Vector]]:
    """Let a place pass a body; return the place, its offset and the offset's rate at each step."""
    bent = BentPlace(PARAMETERS._replace(room=room))
    moving = kind is BodyKind.MOVER
    found, t = [], 0.0
    while t * speed < 8.0:
        place = (0.0 if moving else -4.0 + speed * t, 0.0, 1.0)
        velocity = (0.0 if moving else speed, 0.0, 0.0)
        center = (4.0 - speed * t if moving else 0.0, aside, 1.0)
        body = Body(kind, subtract(center, place), radius, (-speed, 0.0, 0.0) if moving else ZERO)
        found.append((subtract(place, center), *bent.update(place, velocity, place, (body,), DT)))
        t += DT
    return found


@settings(max_examples=15)
@given(
    st.floats(0.1, 0.5), st.floats(-1.2, 1.2), st.floats(0.1, 0.6), st.sampled_from((BodyKind.OBSTACLE, BodyKind.MOVER))
)
def test_a_place_that_passes_a_body_stays_clear_of_it_and_is_continuous(
    speed: float, aside: float, radius: float, kind: BodyKind
) -> None:
    steps = passing(speed, aside, radius, kind)
    kept = 0.33 + radius
    assert min(hypot(*add(place, offset)[:2]) for place, offset, _ in steps) >= min(kept, abs(aside))
    for (_, offset, rate), (_, following, after) in pairwise(steps):
        assert dist(offset, following) <= DT * (PARAMETERS.speed - (speed if kind is BodyKind.OBSTACLE else 0.0)) + 1e-9
        assert dist(rate, after) <= 3.0 * DT + 0.051  # it ends when it is slower than ARRIVED
    assert steps[-1][1:] == (ZERO, ZERO)
    worst = max(hypot(*offset) for _, offset, _ in steps)
    assert worst <= max(kept + SPARE - abs(aside), 0.0) + 0.06


def test_a_mover_is_passed_before_it_is_near() -> None:
    """At this time before it the safety filter would push the drone on, had it not gone aside."""
    speed, radius = 1.0, 0.35
    moves = passing(speed, 0.0, radius, BodyKind.MOVER)
    beside = [hypot(*offset) for place, offset, _ in moves if -speed * PARAMETERS.early <= place[0] <= 0.0]
    assert min(beside) >= 0.33 + radius


def test_a_body_beside_the_way_bends_no_place() -> None:
    assert {offset for _, offset, _ in passing(0.3, 1.0, 0.4)} == {ZERO}


def test_the_side_with_a_wall_is_not_taken() -> None:
    narrow = Room((-20.0, -0.5, 0.0), (20.0, 20.0, 3.0))
    assert min(offset[1] for _, offset, _ in passing(0.3, 0.2, 0.4)) < -0.4
    assert min(offset[1] for _, offset, _ in passing(0.3, 0.2, 0.4, room=narrow)) > -0.05


@pytest.mark.parametrize(
    ("place", "bodies", "nearest"),
    [
        ((0.2, 0.0, 1.0), (Body(BodyKind.OBSTACLE, (-0.2, 0.0, 0.0), 0.4),), (0.78, 0.0)),
        ((0.2, 0.0, 1.0), (Body(BodyKind.MOVER, (-0.2, 0.0, 0.0), 0.4),), (0.78, 0.0)),
        ((21.0, 5.0, 1.0), (), (20.0, 5.0)),
    ],
    ids=["in an obstacle", "in a person who stands", "outside the fence"],
)
def test_a_place_that_cannot_be_had_is_bent_to_the_nearest_that_can(
    place: Vector, bodies: tuple[Body, ...], nearest: tuple[float, float]
) -> None:
    bent = BentPlace(PARAMETERS)
    for _ in range(500):
        offset, rate = bent.update(place, ZERO, place, bodies, DT)
    assert add(place, offset)[:2] == pytest.approx(nearest, abs=1e-3)
    assert hypot(*rate) < 1e-3


def test_a_neighbour_in_the_way_of_a_person_finds_room() -> None:
    """The neighbour comes to 0.4 m at 0.4 m/s; the person is far enough aside."""
    bent, place = BentPlace(PARAMETERS), (0.0, 0.0, 1.0)
    neighbour = Body(BodyKind.DRONE, (0.0, -0.6, 0.0), 0.0, (0.0, 0.4, 0.0))
    person = Body(BodyKind.MOVER, (0.0, -1.9, 0.0), 0.4, (1.0, 0.0, 0.0))
    for _ in range(100):
        alone, _ = bent.update(place, ZERO, place, (neighbour,), DT)
    assert alone == ZERO
    for _ in range(200):
        offset, _ = bent.update(place, ZERO, place, (neighbour, person), DT)
    assert offset[1] == pytest.approx(0.48 - 0.6 + 0.6 * 0.4, abs=0.01)


def test_a_place_on_an_obstacles_axis_keeps_its_side_whatever_the_noise() -> None:
    """Without that the nearest free place is in a new direction at each step."""
    bent, chance, offsets = BentPlace(PARAMETERS), Random(1), []
    for _ in range(1000):
        noisy = (chance.gauss(0.0, 0.001), chance.gauss(0.0, 0.001), 1.0)
        offsets.append(bent.update(noisy, ZERO, ZERO, [Body(BodyKind.OBSTACLE, ZERO, 0.3)], DT)[0])
    way = sum(dist(a, b) for a, b in pairwise(offsets[500:]))
    assert hypot(*offsets[-1]) == pytest.approx(0.63 + SPARE, abs=0.01)
    assert way < 0.3


def test_a_place_in_an_obstacle_stays_at_rest_though_its_speed_is_noisy() -> None:
    """In motion it would pass the obstacle across the shortest way out."""
    bent, chance, offsets = BentPlace(PARAMETERS), Random(1), []
    place, pillar = (0.2, 0.0, 1.0), [Body(BodyKind.OBSTACLE, (-0.2, 0.0, 0.0), 0.4)]
    bent.update(place, ZERO, place, pillar, DT)
    for _ in range(1000):
        velocity = (0.0, chance.uniform(0.01, 0.05), 0.0)
        offsets.append(bent.update(place, velocity, place, pillar, DT)[0])
    assert sum(dist(a, b) for a, b in pairwise(offsets[500:])) < 1e-3
    assert offsets[-1][:2] == pytest.approx((0.58, 0.0), abs=1e-3)
