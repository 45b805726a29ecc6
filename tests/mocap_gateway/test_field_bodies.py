from math import dist

import pytest
from flockwire_core.domain.body import Body, BodyKind
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_mocap.field_bodies import FEW, FORGET, LEFT, MOST_MOVERS, FieldBodies, Stray, Vicinity
from hypothesis import given
from hypothesis import strategies as st

FRAME = SECOND // 100
NOW = 1_790_000_000 * SECOND


@pytest.fixture
def field(make_swarm):
    """Return a field of the small swarm, with a tracked cart."""
    cart = {"body": "cart", "radius": 0.2, "height": 1.0}
    return FieldBodies(make_swarm({"tracked_obstacles": [cart], "gateway": {"person_radius": 0.5}}))


def walk(field, name, frames=60, speed=1.0):
    for k in range(frames):
        field.see_other(name, NOW + k * FRAME, (speed * k / 100, 1.0, 1.7))
    return NOW + (frames - 1) * FRAME, speed * (frames - 1) / 100


def test_a_person_is_an_endless_cylinder_with_its_velocity(field):
    now, x = walk(field, "Ada")
    field.see_drone(1, Pose(now, "world", (x, 0.0, 0.4)))
    field.arrange(now)
    (body,) = field.near(1, (x, 0.0, 0.4))
    assert (body.kind, body.relative_position, body.radius) == (BodyKind.MOVER, (0.0, 1.0, 0.0), 0.5)
    assert body.velocity == pytest.approx((1.0, 0.0, 0.0), abs=1e-6)


def test_a_tracked_obstacle_has_the_size_of_the_swarm_file_and_stays_where_it_was_seen(field):
    now, x = walk(field, "cart")
    for later in (0, 5 * FORGET):
        field.arrange(now + later)
        (body,) = field.near(1, (x, 0.0, 2.0))
        assert (body.relative_position, body.radius) == ((0.0, 1.0, -1.0), 0.2)


def test_a_tracked_obstacle_that_was_moving_when_it_was_lost_stands(field):
    now, x = walk(field, "cart")
    field.arrange(now + FORGET)
    assert field.near(1, (x, 0.0, 2.0))[0].velocity == (0.0, 0.0, 0.0)


def test_a_person_who_is_no_longer_seen_may_be_as_far_as_a_person_walks_then_has_left(field):
    now, x = walk(field, "Ada")
    radii = []
    for age in (0.0, 0.05, 0.5, 0.9, 2.0, 4.9):
        field.arrange(now + nanoseconds(age))
        (body,) = field.near(1, (x, 0.0, 1.0))
        assert body.relative_position == (0.0, 1.0, 0.0)
        radii.append(body.radius)
    assert radii == pytest.approx([0.5, 0.5, 1.0, 1.4, 1.5, 1.5])
    field.arrange(now + LEFT)
    assert field.near(1, (x, 0.0, 1.0)) == ()


def test_whoever_carries_the_leader_stays_on_the_field(make_swarm):
    field = FieldBodies(make_swarm({"leader.kind": "tracked", "drones.0.start": [0.0, 0.0, 1.2]}))
    field.see_drone(0, Pose(NOW, "world", (0.0, 1.0, 1.2)))
    field.arrange(NOW + 10 * LEFT)
    (body,) = field.near(1, (0.0, 0.0, 1.0))
    assert (body.relative_position, body.radius) == ((0.0, 1.0, 0.0), pytest.approx(1.4))


def test_one_who_comes_back_has_no_velocity_from_before(field):
    now, x = walk(field, "Ada")
    field.see_other("Ada", now + 2 * FORGET, (x, 1.0, 1.7))
    field.arrange(now + 2 * FORGET)
    assert field.near(1, (x, 0.0, 1.0))[0].velocity == (0.0, 0.0, 0.0)


def test_a_new_person_is_seen_however_many_names_there_were_before(field):
    field.see_other("cart", NOW, (0.0, 1.0, 0.0))
    for k in range(MOST_MOVERS):
        field.see_other(f"marker {k}", NOW, (0.0, 0.0, 1.0))
    field.arrange(NOW + LEFT)
    field.see_other("Ada", NOW + LEFT, (1.0, 0.0, 1.7))
    field.arrange(NOW + LEFT)
    assert field.others == ("cart", "Ada")
    assert [body.relative_position[:2] for body in field.near(1, (0.0, 0.0, 1.0))] == [(0.0, 1.0), (1.0, 0.0)]


def test_a_body_that_is_not_believed_to_be_a_drones_is_there_until_it_is(field):
    field.see_other(Stray(2), NOW, (1.0, 0.0, 1.0))
    field.arrange(NOW)
    assert [body.kind for body in field.near(1, (0.0, 0.0, 1.0))] == [BodyKind.MOVER]
    assert field.near(2, (1.0, 0.0, 1.0)) == ()  # it is in nobody's way there but others'
    assert field.others == ()
    field.see_drone(2, Pose(NOW, "world", (1.0, 0.0, 1.0)))
    field.arrange(NOW)
    assert [body.kind for body in field.near(1, (0.0, 0.0, 1.0))] == [BodyKind.DRONE]


def test_what_was_not_believed_to_be_a_drones_is_gone_after_a_second_and_does_not_grow(field):
    field.see_other(Stray(2), NOW, (1.0, 0.0, 1.0))
    field.arrange(NOW + FORGET - FRAME)
    assert field.near(1, (0.0, 0.0, 1.0))[0].radius == 0.5
    field.arrange(NOW + FORGET)
    assert field.near(1, (0.0, 0.0, 1.0)) == ()


def test_a_crowd_sorted_by_place_shows_the_same_as_a_look_at_all(make_swarm, monkeypatch):
    many, found = 2 * FEW, []
    for few in (FEW, 10 * FEW):
        monkeypatch.setattr("flockwire_mocap.field_bodies.FEW", few)
        field = FieldBodies(make_swarm({"gateway": {"person_radius": 0.9}}))
        for k in range(many):
            place = (k % 8 * 0.9, k // 8 * 0.9, 1.0)
            (field.see_drone(k, Pose(NOW, "world", place)) if k % 2 else field.see_other(f"person {k}", NOW, place))
        field.arrange(NOW)
        found.append(
            [sorted(field.near(k, (k % 8 * 0.9, k // 8 * 0.9, 1.0)), key=Body.fields) for k in range(1, many, 2)]
        )
    assert found[0] == found[1]
    assert max(map(len, found[0])) > 8


coordinate = st.floats(-6.0, 6.0)
places = st.lists(st.tuples(coordinate, coordinate, coordinate), max_size=40)


@given(places, st.tuples(coordinate, coordinate, coordinate), st.floats(0.1, 3.0))
def test_the_grid_finds_what_looking_at_all_finds(
    places: list[tuple[float, float, float]], position: tuple[float, float, float], reach: float
) -> None:
    found = [key for key in Vicinity(places, reach).round(position) if dist(places[key], position) < reach]
    assert found == [key for key, place in enumerate(places) if dist(place, position) < reach]
