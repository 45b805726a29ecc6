"""The way round bodies that stand in the way: free directions, one side at a time, and drones that give way."""

from __future__ import annotations

from math import cos, dist, hypot, inf, pi, radians, sin

import pytest
from flockwire_core.control.around.bent_place import DetourParameters
from flockwire_core.control.around.way_round import BERTH, WayRound, is_straight, turns, widened
from flockwire_core.control.fence import Room
from flockwire_core.domain.body import Body, BodyKind, Separation
from flockwire_core.domain.motion import Motion
from flockwire_core.domain.vector import ZERO, Vector
from hypothesis import given
from hypothesis import strategies as st

PARAMETERS = DetourParameters(Separation(0.43, 0.33), Room((-20.0, -20.0, 0.0), (20.0, 20.0, 3.0)), 1.0, 10.0, 0.5)
discs = st.lists(st.tuples(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.floats(0.1, 1.0)), min_size=1, max_size=5)
goals = st.tuples(st.floats(-4.0, 4.0), st.floats(-4.0, 4.0)).filter(lambda goal: hypot(*goal) > 0.1)


@given(discs, goals)
def test_a_free_direction_meets_no_disc_that_is_nearer_than_the_goal(
    found: list[tuple[float, float, float]], goal: tuple[float, float]
) -> None:
    reach = hypot(*goal)
    for sign, turn in zip((1.0, -1.0), turns(goal, found), strict=True):
        if turn >= pi:
            continue
        c, s = cos(sign * turn), sin(sign * turn)
        ux, uy = (c * goal[0] - s * goal[1]) / reach, (s * goal[0] + c * goal[1]) / reach
        for x, y, r in found:
            rho = hypot(x, y)
            if r < rho < reach + r and x * ux + y * uy > 0.0:
                assert abs(ux * y - uy * x) >= r - 1e-6


@given(discs, goals)
def test_the_mirror_image_has_the_mirrored_turns(
    found: list[tuple[float, float, float]], goal: tuple[float, float]
) -> None:
    left, right = turns(goal, found)
    assert turns((goal[0], -goal[1]), [(x, -y, r) for x, y, r in found]) == pytest.approx((right, left), abs=1e-6)


def test_a_straight_way_may_touch() -> None:
    assert is_straight((3.0, 0.0), [(1.0, 0.5, 0.5), (5.0, 0.0, 1.0), (-1.0, 0.0, 0.5)])
    assert not is_straight((3.0, 0.0), [(1.0, 0.4, 0.5)])


def at(position: Vector) -> Motion:
    return Motion(position, ZERO, position)


def test_a_wall_is_passed_though_little_of_it_is_in_sight() -> None:
    """Of a wall of 17 posts, 0.3 m apart, it sees those within 1.5 m; its place is behind the middle."""
    way, position, goal = WayRound(PARAMETERS, 3.0), (-1.0, 0.1, 1.0), (1.5, 0.0, 1.0)
    posts = [(0.0, 0.3 * k) for k in range(-8, 9)]
    for step in range(3000):
        seen = [
            Body(BodyKind.OBSTACLE, (x - position[0], y - position[1], 0.0), 0.0)
            for x, y in posts
            if hypot(x - position[0], y - position[1]) < 1.5
        ]
        to_go = (goal[0] - position[0], goal[1] - position[1])
        scaled = min(1.0, 0.5 / max(hypot(*to_go), 1e-9))
        correction = (scaled * to_go[0], scaled * to_go[1], 0.0)
        (x, y, _), _ = way.turned(correction, at(position), ZERO, to_go, seen, 0.01 * step)
        position = (position[0] + 0.01 * x, position[1] + 0.01 * y, 1.0)
        if dist(position, goal) < 0.2:
            break
    assert dist(position, goal) < 0.2


def test_who_stands_before_a_drone_gives_way_after_its_patience() -> None:
    walls = [Body(BodyKind.OBSTACLE, (x, y, 0.0), 0.3) for x in (-0.6, 0.0, 0.6) for y in (-0.66, 0.66)]
    other = Body(BodyKind.DRONE, (0.6, 0.0, 0.0), 0.0)
    gone = {}
    for patience in (1.5, 2.0):
        way = WayRound(PARAMETERS, patience)
        for step in range(1000):
            (x, _, _), _ = way.turned((0.5, 0.0, 0.0), at(ZERO), ZERO, (2.0, 0.0), [*walls, other], 0.01 * step)
            if x < 0.0:
                gone[patience] = 0.01 * step
                break
    assert gone[1.5] == pytest.approx(1.5, abs=0.05)
    assert gone[2.0] == pytest.approx(2.0, abs=0.05)


def first_back(other_speed: float, walls: list[Body], patience: float) -> float:
    """Return when a drone in a gap first flies back, s; the other one flies at 0 and `other_speed` in turn."""
    way = WayRound(PARAMETERS, patience)
    for step in range(1000):
        now = 0.01 * step
        velocity = (other_speed * (step // 30 % 2), 0.0, 0.0)
        other = Body(BodyKind.DRONE, (0.6, 0.0, 0.0), 0.0, velocity)
        (x, _, _), _ = way.turned((0.5, 0.0, 0.0), at(ZERO), ZERO, (2.0, 0.0), [*walls, other], now)
        if x < 0.0:
            return now
    return inf


def test_who_waits_is_not_calmed_by_another_drone_that_moves_to_and_fro() -> None:
    walls = [Body(BodyKind.OBSTACLE, (x, y, 0.0), 0.3) for x in (-0.6, 0.0, 0.6) for y in (-0.66, 0.66)]
    assert first_back(0.5, walls, 1.5) == pytest.approx(1.5, abs=0.35)


def test_in_a_gap_nobody_turns_back_before_its_patience_ends() -> None:
    """From both ends they would leave it together, and meet in it again."""
    gap = [Body(BodyKind.OBSTACLE, (0.4, y, 0.0), 0.3) for y in (-0.66, 0.66)]
    assert first_back(0.0, gap, 1.5) == pytest.approx(1.5, abs=0.05)


def test_a_drone_on_the_move_and_one_at_the_own_place_are_left_to_the_sidestep() -> None:
    way = WayRound(PARAMETERS, 3.0)
    ahead = Body(BodyKind.DRONE, (1.0, 0.0, 0.0), 0.0)
    bodies = (ahead, ahead._replace(velocity=(0.0, 0.5, 0.0)), ahead._replace(relative_position=(2.0, 0.1, 0.0)))
    turned, others = way.turned((0.5, 0.0, 0.0), at(ZERO), ZERO, (2.0, 0.0), bodies, 0.0)
    assert tuple(others) == bodies[1:]
    assert turned[1] < 0.0  # head on all turn right
    assert hypot(*turned) == pytest.approx(0.5)


def test_who_is_shut_out_for_long_does_not_fly_ever_farther_away() -> None:
    way, x, y, farthest = WayRound(PARAMETERS, 2.0), -3.0, 0.0, 0.0  # its place is the origin
    ring = [(cos(0.25 * pi * k), sin(0.25 * pi * k)) for k in range(8)]
    for step in range(6000):
        seen = [Body(BodyKind.DRONE, (a - x, b - y, 0.0), 0.0) for a, b in ring if hypot(a - x, b - y) < 3.0]
        wanted = (-x / hypot(x, y), -y / hypot(x, y), 0.0)
        (vx, vy, _), _ = way.turned(wanted, Motion(ZERO, ZERO, ZERO), ZERO, (-x, -y), seen, 0.05 * step)
        for dx, dy, _ in (body.relative_position for body in seen):
            into = (vx * dx + vy * dy) / hypot(dx, dy)
            if hypot(dx, dy) < 0.45 and into > 0.0:  # as the safety filter does
                vx, vy = vx - into * dx / hypot(dx, dy), vy - into * dy / hypot(dx, dy)
        x, y = x + 0.05 * vx, y + 0.05 * vy
        farthest = max(farthest, hypot(x, y))
    assert farthest < 6.0


@given(st.tuples(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.floats(0.1, 1.0)), goals)
def test_a_berth_never_covers_the_drone_or_its_place_unless_the_disc_does(
    disc: tuple[float, float, float], goal: tuple[float, float]
) -> None:
    x, y, r = widened(disc, goal)
    assert (x, y) == disc[:2]
    assert disc[2] <= r <= disc[2] + BERTH
    assert r == disc[2] or min(hypot(x, y), hypot(goal[0] - x, goal[1] - y)) >= r


def test_a_gap_between_two_drones_is_flown_around_where_that_is_hardly_longer() -> None:
    """The gap of 1 m is wide enough, but there the safety filter slows it down; between four the way round is long."""
    row = [Body(BodyKind.DRONE, (1.5, y, 0.0), 0.0) for y in (-1.4, -0.4, 0.6, 1.6)]
    for bodies, straight in ((row[1:3], False), (row, True)):
        turned, _ = WayRound(PARAMETERS, 3.0).turned((1.0, 0.0, 0.0), at(ZERO), ZERO, (3.0, 0.0), bodies, 0.0)
        assert (abs(turned[1]) < 0.2) == straight


def test_the_side_is_shorter_where_the_place_flies_to() -> None:
    """The pillar's middle is a little to the right, but the place flies to the right: there it will be nearer."""
    pillar = [Body(BodyKind.OBSTACLE, (1.5, -0.1, 0.0), 0.3)]
    for speed, left in ((0.0, True), (-0.3, False)):
        way = WayRound(PARAMETERS, 3.0)
        turned, _ = way.turned((1.0, 0.0, 0.0), at(ZERO), (0.0, speed, 0.0), (3.0, 0.0), pillar, 0.0)
        assert (turned[1] > 0.0) == left


def test_a_side_that_leads_back_is_given_up_where_the_other_one_opens() -> None:
    """Each change of the side is kept for long, but not one that leads back: a drone flew to and fro for 10 s."""
    way, found = WayRound(PARAMETERS, 3.0), []
    for step, angles in enumerate(((-10,), (-10, 40, 90, 140), (10, -40, -90, -140, -190))):
        around = [(1.2 * cos(radians(angle)), 1.2 * sin(radians(angle)), 0.0) for angle in angles]
        pillars = [Body(BodyKind.OBSTACLE, place, 0.3) for place in around]
        (_, y, _), _ = way.turned((1.0, 0.0, 0.0), at(ZERO), ZERO, (2.0, 0.0), pillars, 0.1 * step)
        found.append(y > 0.0)
    assert found == [True, False, True]
