"""The planner in scenes of one and two drones, x' = u, with what the safety filter does to them."""

from __future__ import annotations

from math import cos, dist, hypot, inf, pi, sin, sqrt

import pytest
from flockwire_core.control.around.planner import SPARE, Planner, together
from flockwire_core.control.fence import Room
from flockwire_core.control.free_place import Disc
from flockwire_core.control.guard import GuardParameters
from flockwire_core.domain.body import Body, BodyKind, Separation
from flockwire_core.domain.motion import Motion
from flockwire_core.domain.vector import ZERO, Vector, add, scale, subtract
from hypothesis import given
from hypothesis import strategies as st

GUARD = GuardParameters(
    separation=Separation(0.43, 0.33),
    room=Room((-20.0, -20.0, 0.0), (20.0, 20.0, 3.0)),
    floor=0.15,
    speed=1.0,
    vertical_speed=0.7,
    acceleration=10.0,
    barrier_rate=5.0,
    slowness=0.0,
    period=0.02,
    sight=1.5,
    unheard=0.2,
)
K, DT = 3.0, 0.02


class Drone:
    """A drone with its place, which moves at `velocity`."""

    def __init__(self, number: int, start: Vector, place: Vector, velocity: Vector = ZERO) -> None:
        self.planner, self.position, self.place = Planner(GUARD, K, number), start, place
        self.going, self.velocity = velocity, ZERO
        self.changed, self.turned_back, self.deviation = 0, 0.0, 0.0

    def step(self, obstacles: list[Disc], others: list[Vector], now: float) -> None:
        x, y, _ = self.position
        bodies = [Body(BodyKind.OBSTACLE, (a - x, b - y, 0.0), r) for a, b, r in obstacles]
        bodies += [Body(BodyKind.DRONE, subtract(other, self.position), 0.0) for other in others]
        bodies = [body for body in bodies if hypot(*body.relative_position[:2]) - body.radius < GUARD.sight]
        motion, error = Motion(self.position, self.velocity, self.position), subtract(self.position, self.place)
        wanted = add(self.going, self.planner.correction(error, motion, self.going, bodies, now))
        self.velocity = filtered(wanted, bodies)
        self.changed += dist(wanted, self.velocity) > 0.01
        self.position = add(self.position, scale(self.velocity, DT))
        self.place = add(self.place, scale(self.going, DT))
        self.deviation = max(self.deviation, dist(self.position, self.place))


def filtered(velocity: Vector, bodies: list[Body]) -> Vector:
    for body in bodies:
        x, y, z = body.relative_position
        gap = sqrt(x * x + y * y + z * z)
        most = 5.0 * (gap - GUARD.separation.from_axis(body)) * (0.5 if body.kind is BodyKind.DRONE else 1.0)
        into = (velocity[0] * x + velocity[1] * y + velocity[2] * z) / gap - most
        if into > 0.0:
            velocity = subtract(velocity, scale((x, y, z), into / gap))
    return velocity


def arrival(drones: list[Drone], obstacles: list[Disc], standing: list[Vector] = [], most: float = 30.0) -> float:  # noqa: B006
    """Fly until all are at their places; returns the time, s."""
    for k in range(round(most / DT)):
        places = [drone.position for drone in drones]
        for i, drone in enumerate(drones):
            drone.step(obstacles, [*places[:i], *places[i + 1 :], *standing], k * DT)
        if all(dist(drone.position, drone.place) < 0.05 for drone in drones):
            return k * DT
    return inf


@given(st.tuples(*[st.floats(-1.0, 1.0)] * 3), st.floats(0.0, 9.0))
def test_without_bodies_the_correction_is_that_of_the_law(error: Vector, now: float) -> None:
    error = scale(error, 0.3 / max(dist(error, ZERO), 0.3))
    correction = Planner(GUARD, K, 1).correction(error, Motion(error, ZERO, error), ZERO, (), now)
    assert correction == pytest.approx(scale(error, -K))


@pytest.mark.parametrize("aside", [0.0, 0.2])
def test_a_place_that_passes_an_obstacle_is_passed_as_near_as_allowed_and_the_filter_does_nothing(aside: float) -> None:
    drone = Drone(1, (-2.0, 0.0, 1.0), (-2.0, 0.0, 1.0), (0.3, 0.0, 0.0))
    for k in range(700):
        drone.step([(0.0, aside, 0.37)], [], k * DT)
    assert 0.70 - aside < drone.deviation < 0.71 - aside
    assert drone.changed < 35  # of 700
    assert dist(drone.position, drone.place) < 0.01


def test_a_place_in_an_obstacle_is_waited_for_at_the_nearest_point() -> None:
    drone = Drone(1, (-1.0, 0.4, 1.0), (0.1, 0.0, 1.0))
    arrival([drone], [(0.0, 0.0, 0.2)], most=8.0)
    assert drone.position == pytest.approx((0.53 + SPARE, 0.0, 1.0), abs=0.03)


def test_a_wall_of_which_little_is_in_sight_is_passed() -> None:
    """Of 17 posts, 0.3 m apart, it sees those within 1.5 m; its place is behind the middle."""
    drone = Drone(1, (-1.0, 0.1, 1.0), (1.5, 0.0, 1.0))
    assert arrival([drone], [(0.0, 0.3 * k, 0.0) for k in range(-8, 9)]) < 12.0


def test_a_dead_end_wider_than_its_sight_is_left_once() -> None:
    end = [(1.8, 0.3 * k, 0.0) for k in range(-8, 9)]
    sides = [(1.8 - 0.3 * k, side, 0.0) for k in range(1, 12) for side in (-2.4, 2.4)]
    assert arrival([Drone(1, (-1.0, 0.1, 1.0), (3.5, 0.0, 1.0))], end + sides) < 25.0


def test_an_obstacle_that_went_while_it_was_in_sight_holds_nobody_off_its_place() -> None:
    drone, wide = Drone(1, (-3.0, 0.1, 1.0), (0.0, 0.0, 1.0)), [(0.0, 0.0, 1.3)]
    beside = [(-3.0, 3.0, 1.0)]
    arrival([drone], wide, beside, 5.0)
    assert drone.deviation > 1.0
    assert arrival([drone], [], [(0.8, 0.0, 1.0)]) < 10.0


def test_the_side_of_the_last_way_is_kept() -> None:
    for first in (-0.05, 0.05):  # the obstacle moves a little to the other side of the line to the place
        drone = Drone(1, (-1.4, 0.0, 1.0), (1.4, 0.0, 1.0))
        heights = []
        for k in range(100):
            drone.step([(0.0, first if k < 10 else -first, 0.3)], [], k * DT)
            heights.append(drone.position[1])
        assert max(heights, key=abs) * first < 0.0
        assert min(heights) * max(heights) >= 0.0


def correction(bodies: list[Body], velocity: Vector = ZERO) -> Vector:
    """Return that of a drone at rest at the origin, whose place is 3 m ahead and stands."""
    return Planner(GUARD, K, 1).correction((-3.0, 0.0, 0.0), Motion(ZERO, velocity, ZERO), ZERO, bodies, 1.0)


def drone(x: float, y: float, velocity: Vector = ZERO) -> Body:
    return Body(BodyKind.DRONE, (x, y, 0.0), 0.0, velocity)


def test_no_turn_of_its_own_changes_who_is_in_the_way() -> None:
    """It turned aside, so the other one was no longer in the way, so it turned back."""
    other = drone(1.2, 0.4, (-0.8, 0.0, 0.0))
    straight, aside = (correction([other], velocity) for velocity in (ZERO, (0.5, -1.0, 0.0)))
    assert straight == aside
    assert straight[1] < -0.1


def test_drones_that_meet_choose_the_right_though_the_left_is_a_little_shorter() -> None:
    assert correction([drone(1.0, -0.12)])[1] < -0.1
    assert correction([Body(BodyKind.OBSTACLE, (1.0, -0.12, 0.0), 0.13)])[1] > 0.1


def test_who_flies_straight_turns_back_for_nobody() -> None:
    planner, rest = Planner(GUARD, K, 1), Motion(ZERO, ZERO, ZERO)
    planner.correction((-3.0, 0.0, 0.0), rest, ZERO, [drone(-1.0, 0.0)], 1.0)
    x, _, _ = planner.correction((-3.0, 0.0, 0.0), rest, ZERO, [drone(0.5, -0.1)], 1.11)
    assert x > 0.5


@pytest.mark.parametrize(("rows", "above"), [(1, True), (3, False)])
def test_a_row_of_drones_is_passed_above_and_a_crowd_is_passed_round(rows: int, above: bool) -> None:
    row = [drone(1.0 + 0.2 * k, y) for k in range(rows) for y in (-0.8, 0.0, 0.8)]
    _, y, z = correction(row)
    assert (z != 0.0, abs(y) > 0.1) == (above, not above)


def test_who_passes_drones_above_goes_on_though_the_way_round_is_a_little_shorter_now() -> None:
    planner, rest, height = Planner(GUARD, K, 1), Motion(ZERO, ZERO, ZERO), []
    for t, width in enumerate((0.47, 0.8, 0.47)):
        row = [drone(1.9, y) for y in (-width, 0.0, width)]
        height.append(planner.correction((-3.8, 0.0, 0.0), rest, ZERO, row, 1.0 + 0.11 * t)[2])
    assert height[0] == 0.0
    assert height[1] == height[2] != 0.0


def test_the_side_on_which_a_place_passes_is_kept() -> None:
    drone, sides = Drone(1, (-2.0, 0.0, 1.0), (-2.0, 0.0, 1.0), (0.3, 0.0, 0.0)), []
    for k in range(400):  # its tracker moves the obstacle from one side to the other, five times a second
        drone.step([(0.0, -0.1 if k // 10 % 2 else 0.1, 0.37)], [], k * DT)
        sides.append(drone.position[1])
    assert max(sides) < 0.01
    assert drone.deviation < 0.8


def test_a_place_passes_on_the_side_with_the_shorter_way_though_the_other_is_nearer() -> None:
    """The obstacle that its place passes is between the drone and its nearer side."""
    drone, sides = Drone(1, (1.6, 1.1, 1.0), (0.0, 0.0, 1.0), (0.3, 0.0, 0.0)), []
    for k in range(300):
        drone.step([(1.6, -0.7, 0.2), (0.7, 0.1, 0.3), (0.3, 0.9, 0.1)], [], k * DT)
        sides.append(drone.position[1])
    assert min(sides) > -0.05
    assert dist(drone.position, drone.place) < 0.01


def test_obstacles_that_touch_are_met_at_one_time_and_no_gap_opens_between_them() -> None:
    row = [(0.0, 0.0, 0.5), (3.0, 0.0, 0.5), (1.8, 0.0, 0.5), (0.9, 0.0, 0.5)]
    assert together(row, [0.4, 0.9, 0.7, 0.2]) == [0.2, 0.9, 0.2, 0.2]


def test_a_ring_of_standing_drones_round_a_free_place_is_passed() -> None:
    ring = [(cos(0.25 * pi * k), sin(0.25 * pi * k), 1.0) for k in range(8)]
    drone = Drone(1, (-3.0, 0.1, 1.0), (0.0, 0.0, 1.0))
    assert arrival([drone], [], ring) < 8.0


@pytest.mark.parametrize("length", [1, 3])
@pytest.mark.parametrize("turn", [0.0, 0.5 * pi, 2.2])
def test_two_exchange_sides_through_a_gap_one_drone_wide(length: int, turn: float) -> None:
    """One flies above the other, whichever way the gap points; nobody waits."""
    c, s = cos(turn), sin(turn)
    reach = 0.6 * (length - 1)
    gap = [(0.6 * k, side * y, 0.3) for k in range(length) for y in (0.7, 1.3) for side in (-1.0, 1.0)]
    gap = [(c * x - s * y, s * x + c * y, r) for x, y, r in gap]
    west, east = (-1.6 * c, -1.6 * s, 1.0), ((1.6 + reach) * c, (1.6 + reach) * s, 1.0)
    assert arrival([Drone(1, west, east), Drone(2, east, west)], gap) < 2.5 * (3.2 + reach)
