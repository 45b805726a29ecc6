"""The safety filter by itself; tests/agent/test_safety_clauses.py flies each of its clauses."""

from dataclasses import replace
from math import dist, exp, hypot

import pytest
from flockwire_core.control.guard import Guard
from flockwire_core.domain.body import Body, BodyKind
from flockwire_core.domain.motion import Motion
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import add, norm, scale, subtract
from flockwire_core.parameters import guard_parameters


def test_a_drone_that_cannot_keep_clear_is_no_faster_anyway(make_swarm):
    """A body comes from behind at 5 m/s: no velocity within the limits gets out of its way."""
    swarm = make_swarm({"control.law": "extended"})
    parameters = guard_parameters(swarm, 1)
    filtered, last = Guard(parameters), (2.6, 0.0, 0.0)
    for step in range(1, 30):
        at = step * SECOND // 100
        x, behind = 0.026 * step, Body(BodyKind.DRONE, (0.024 * step - 1.0, 0.0, 0.0), 0.0)
        motion = Motion((x, 0.0, 1.0), last, (x, 0.0, 1.0))
        bodies = filtered.tracked(motion, (behind,), at)
        last = filtered.velocity((3.0, 0.0, 0.0), motion, bodies, at, at, last, 0.01, 3.0, False)
        assert hypot(*last) <= parameters.fastest + 1e-12
    assert hypot(*last) == pytest.approx(parameters.fastest)


@pytest.mark.parametrize("period", [0.01, 0.05, 0.1])
def test_a_drone_of_any_rate_keeps_its_speed(make_swarm, period):
    """At 20 Hz a command may change by 0.5 m/s; a limit of 0.5 m/s halved each command, down to none."""
    swarm = make_swarm({"control.law": "extended", "limits.acceleration": 10.0})
    filtered, last = Guard(guard_parameters(swarm, 1)), (0.0, 0.0, 0.0)
    motion = Motion((0.0, 0.0, 1.0), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    for step in range(1, 20):
        at = round(step * period * SECOND)
        last = filtered.velocity((0.5, 0.0, 0.0), motion, (), at, at, last, period, 0.5, False)
        assert last[0] > 0.97 * min(0.5, 10.0 * period * step)


@pytest.mark.parametrize(
    ("kinds", "held"),
    [((), (False, False)), ((BodyKind.DRONE,), (True, False)), ((BodyKind.OBSTACLE, BodyKind.DRONE), (True, True))],
    ids=["by its limits alone", "for a drone", "for an obstacle too"],
)
def test_a_velocity_is_changed_by_limits_for_what_is_fixed_or_for_others(make_swarm, kinds, held):
    filtered = Guard(guard_parameters(make_swarm({"control.law": "extended"}), 1))
    motion = Motion((0.0, 0.0, 1.0), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    places = {BodyKind.OBSTACLE: (0.0, 0.33, 0.0), BodyKind.DRONE: (0.43, 0.0, 0.0)}
    bodies = filtered.tracked(motion, [Body(kind, places[kind], 0.0) for kind in kinds], SECOND)
    wanted = (1.0, 1.0, 0.0)
    given = filtered.velocity(wanted, motion, bodies, SECOND, SECOND, (0.0, 0.0, 0.0), 0.01, 3.0, False)
    assert given != wanted
    assert (filtered.is_held, filtered.is_held_by_fixed) == held


@pytest.mark.parametrize("kind", [BodyKind.OBSTACLE, BodyKind.MOVER])
def test_a_drone_inside_a_grown_body_leaves_slowly_but_flees_a_person(make_swarm, kind):
    swarm = make_swarm({"control.law": "extended"})
    parameters = guard_parameters(swarm, 1)
    filtered, last = Guard(parameters), (0.0, 0.0, 0.0)
    motion = Motion((0.0, 0.0, 1.0), last, (0.0, 0.0, 1.0))
    for step in range(1, 40):
        at = step * SECOND // 100
        body = Body(kind, (0.1, 0.0, 0.0), 1.0)
        last = filtered.velocity((0.0, 0.0, 0.0), motion, (body,), at, at, last, 0.01, 3.0, False)
    assert (hypot(*last) > 2.0) == (kind is BodyKind.MOVER)
    if kind is BodyKind.OBSTACLE:
        assert last == pytest.approx((-swarm.limits.vertical_speed, 0.0, 0.0))


@pytest.mark.parametrize(("top", "matters"), [(0.0, False), (-0.4, True)], ids=["beside", "above"])
def test_beside_an_upright_person_neither_height_nor_its_rate_matters(make_swarm, top, matters):
    """By its markers a person who walks rises and sinks; a drone beside must not flee upwards or downwards for that."""
    parameters, climbs = guard_parameters(make_swarm({"control.law": "extended"}), 1), []
    for rising in (0.0, 0.5):
        filtered, last, motion = (
            Guard(parameters),
            (0.0, 0.0, 0.0),
            Motion((0.0, 0.0, 1.0), (0.0,) * 3, (0.0, 0.0, 1.0)),
        )
        for step in range(1, 40):
            body, at = Body(BodyKind.MOVER, (0.5, 0.0, top), 0.4, (-0.5, 0.0, rising)), step * SECOND // 100
            last = filtered.velocity((0.0, 0.0, 0.0), motion, (body,), at, at, last, 0.01, 3.0, False)
        climbs.append(last[2])
    assert (climbs[0] != climbs[1]) == matters
    assert matters or climbs == [0.0, 0.0]


@pytest.mark.parametrize("room", [{}, {"polygon": [[-9.0, -9.0], [9.0, -9.0], [0.0, 9.0]]}])
def test_a_landing_far_outside_the_fence_descends_as_it_comes_back(make_swarm, room):
    """By a false pose it never comes back: two drones with each other's names flew 60 m away without descending."""
    swarm = make_swarm(
        {"control.law": "extended", "limits.fence": {"min": [-9.0, -9.0, -0.5], "max": [9.0, 9.0, 3.0], **room}}
    )
    parameters = guard_parameters(swarm, 1)
    filtered, last, outside = Guard(parameters), (0.0, 0.0, 0.0), (15.0, 0.0, 1.0)
    down, motion = -parameters.vertical_speed, Motion(outside, last, outside)
    for step in range(1, 100):
        last = filtered.velocity((0.0, 0.0, down), motion, (), step, step, last, 0.01, 3.0, True)
    assert last[2] == pytest.approx(down)
    assert hypot(last[0], last[1]) == pytest.approx(parameters.vertical_speed, rel=0.05)


@pytest.mark.parametrize(("height", "fastest"), [(0.1, 0.9), (1.0, 3.0)])
def test_a_drone_about_to_touch_down_is_not_moved_sideways_fast(make_swarm, height, fastest):
    """A space where a lost body may be, and a drone on the other side, grow towards it at once."""
    parameters = guard_parameters(make_swarm({"control.law": "extended"}), 1)
    filtered, last, motion = Guard(parameters), (0.0, 0.0, -0.7), Motion((0.0, 0.0, height), (0.0,) * 3, (0, 0, height))
    for step in range(1, 20):
        bodies = (Body(BodyKind.OBSTACLE, (0.5, 0.0, 0.0), 1.0), Body(BodyKind.MOVER, (0.0, 0.4, 0.0), 0.3))
        at = step * SECOND // 100
        last = filtered.velocity((0.0, 0.0, -0.7), motion, bodies, at, at, last, 0.01, 3.0, True)
    assert hypot(*last) <= fastest + 1e-9
    assert (hypot(*last) > 1.0) == (height > 0.5)


def test_what_is_above_does_not_drive_a_landing_into_the_ground(make_swarm):
    """The pose of another drone may have it higher than it is; a fast descent before the landing slows down at once."""
    parameters = guard_parameters(make_swarm({"control.law": "extended"}), 1)
    above, motion = Body(BodyKind.MOVER, (0.0, 0.05, 0.1), 0.4), Motion((0.0, 0.0, 1.0), (0.0,) * 3, (0.0, 0.0, 1.0))
    for grounding, fastest in ((True, 0.9), (False, 3.0)):
        filtered, last, slowing = Guard(parameters), (0.0, 0.0, -2.0), 1.1 / (parameters.acceleration * 0.01)
        for step in range(1, 40):
            at = step * SECOND // 100
            last = filtered.velocity((0.0, 0.0, -0.7), motion, (above,), at, at, last, 0.01, 3.0, grounding)
            assert not grounding or step < slowing or last[2] >= -fastest - 1e-9
        assert (last[2] < -1.0) == (not grounding)


def settled(parameters, wanted, place=(0.0, 0.0, 1.0), age=0.0, body=None, grounding=False):
    """Return what a drone that stays at `place` may fly at in the end; `body`: its x at last; it comes at 0.5 m/s."""
    filtered, last = Guard(parameters), (0.0, 0.0, 0.0)
    for step in range(200):
        at = (1 + step) * SECOND // 100
        coming = () if body is None else (Body(BodyKind.DRONE, (body + 0.005 * (199 - step), 0.0, 0.0), 0.0),)
        motion, now = Motion(place, last, place), at + round(age * SECOND)
        seen = filtered.tracked(motion, coming, at)
        last = filtered.velocity(wanted, motion, seen, at, now, last, 0.01, parameters.speed, grounding)
    return last


@pytest.fixture
def parameters(make_swarm):
    fence = {"min": [-4.0, -4.0, -0.5], "max": [4.0, 4.0, 3.0]}
    return guard_parameters(make_swarm({"control.law": "extended", "limits.fence": fence}), 1)


def test_it_is_no_faster_than_its_sight_lets_two_stop(parameters):
    short = replace(parameters, speed=9.0, sight=1.5)
    assert short.fastest == short.sight_speed(0.0) < 3.0
    assert replace(parameters, speed=0.5).fastest == 0.5


def test_old_sightings_slow_it(parameters):
    speeds = [hypot(*settled(parameters, (9.0, 0.0, 0.0), age=age)) for age in (0.0, 0.1, 0.3)]
    assert speeds == pytest.approx([parameters.sight_speed(age) for age in (0.0, 0.1, 0.3)], abs=0.01)


def test_a_body_is_where_it_can_have_flown_since_it_was_seen(parameters):
    seen, there = (settled(parameters, (0.4, 0.0, 0.0), age=age, body=x) for age, x in ((0.1, 0.6), (0.0, 0.55)))
    assert seen == pytest.approx(there, abs=1e-6)
    assert seen[0] < settled(parameters, (0.4, 0.0, 0.0), body=0.6)[0] - 0.1


@pytest.mark.parametrize("grounding", [False, True], ids=["in flight", "in take-off and landing"])
def test_only_the_floor_is_open_for_a_landing(parameters, grounding):
    x, y, z = settled(parameters, (0.5, -0.5, -0.5), (4.0, -4.0, 0.05), grounding=grounding)
    assert (x, y) == pytest.approx((0.0, 0.0), abs=1e-9)
    assert z == pytest.approx(-0.5) if grounding else z >= 0.0
    assert settled(parameters, (0.0, 0.0, 0.5), (0.0, 0.0, 3.0), grounding=grounding)[2] <= 1e-9


@pytest.mark.parametrize("growth", [0.8, 0.0])
def test_between_a_wall_and_the_space_of_a_lost_body_the_wall_is_kept_clear_of(make_swarm, growth):
    """A search found it: 0.081 m from a pole. Both ask for more than there is; the lost body may be elsewhere."""
    parameters = guard_parameters(make_swarm({"control.law": "extended"}), 1)
    filtered, last = Guard(parameters), (0.0, 0.0, 0.0)
    motion = Motion((0.0, 0.0, 1.0), last, (0.0, 0.0, 1.0))
    wall = Body(BodyKind.OBSTACLE, (-0.5, 0.0, 0.0), 0.3)
    lost = Body(BodyKind.OBSTACLE, (1.0, 0.0, 0.0), 0.8, (-growth, 0.0, 0.0))
    for step in range(1, 40):
        at = step * SECOND // 100
        last = filtered.velocity((0.0, 0.0, 0.0), motion, (wall, lost), at, at, last, 0.01, 3.0, False)
    too_near = 0.3 + parameters.separation.obstacle - 0.5
    assert last[0] == pytest.approx(
        parameters.rate * too_near if growth else 0.0, abs=0.005
    )  # -0.4 if both counted alike


@pytest.mark.parametrize(("seen", "share"), [(1, 0.5), (30, 0.7)], ids=["for the first time", "standing"])
def test_towards_a_drone_without_a_velocity_yet_a_drone_has_half_of_the_approach_speed(make_swarm, seen, share):
    """It may come as fast; one that was seen to stand leaves a larger share (docs/theory.md, section 5)."""
    parameters = guard_parameters(make_swarm({"control.law": "extended"}), 1)
    filtered, last, gap = Guard(parameters), (0.9 * parameters.rate * 0.2, 0.0, 0.0), 0.2
    for step in range(1, 31):
        at, x = step * SECOND // 100, 0.01 * step * last[0]
        ahead = 0.01 * (30 - step) * last[0] + parameters.separation.drone + gap
        bodies = (Body(BodyKind.DRONE, (ahead, 0.0, 0.0), 0.0),) if step > 30 - seen else ()
        motion = Motion((x, 0.0, 1.0), last, (x, 0.0, 1.0))
        bodies = filtered.tracked(motion, bodies, at)
    allowed = (share * parameters.rate * gap, 0.0, 0.0)
    v = filtered.velocity(last, motion, bodies, at, at, allowed, 0.01, 3.0, False)
    assert v == pytest.approx(allowed)


def test_of_two_that_descend_together_neither_counts_on_passing_below_the_other(make_swarm):
    """Each knows its own descent before the other one sees it: both counted on it, and came nearer."""
    swarm = make_swarm({"control.law": "extended", "airframes": {"kinematics": {"lag": 0.25, "dead_time": 0.1}}})
    parameters = guard_parameters(swarm, 1)
    filtered, gap, last = Guard(parameters), 0.1, (0.0, 0.0, 0.0)
    for step in range(1, 61):  # it hovers, and is about to descend, and to fly on by 0.1 m
        at = step * SECOND // 100
        aside = Body(BodyKind.DRONE, (parameters.separation.drone + gap, 0.0, 0.0), 0.0)
        motion = Motion((0.0, 0.0, 2.0), (0.0,) * 3, (0.1, 0.0, 1.7))
        bodies = filtered.tracked(motion, (aside,), at)
        last = filtered.velocity((1.0, 0.0, -1.2), motion, bodies, at, at, last, 0.01, 3.0, False)
    assert last[0] <= 0.7 * parameters.rate * gap + 1e-9


def halted(parameters, *bodies, last=(0.0, 0.0, 0.0), steps=1):
    """Return the filter and the velocity of a drone that stands and wants to stand, after some steps."""
    filtered, motion = Guard(parameters), Motion((0.0, 0.0, 1.0), last, (0.0, 0.0, 1.0))
    for step in range(1, steps + 1):
        at = step * SECOND // 100
        last = filtered.velocity((0.0, 0.0, 0.0), motion, bodies, at, at, last, 0.01, 3.0, False)
    return filtered, last


def coming(kind, speed, gap=0.0):
    """Return a body behind, `gap` m beyond its safety distance, that comes at `speed` m/s."""
    return Body(kind, (-(0.43 if kind is BodyKind.DRONE else 0.73) - gap, 0.0, 0.0), 0.4, (speed, 0.0, 0.0))


WALL = Body(BodyKind.OBSTACLE, (0.63, 0.0, 0.0), 0.3)  # just at its safety distance
NEIGHBOUR = Body(BodyKind.DRONE, (0.43, 0.0, 0.0), 0.0)


def test_a_drone_that_asks_for_flight_does_not_drive_another_into_a_wall(parameters):
    """It comes into sight at 2 m/s and asks for as much flight: half of that relaxed the wall."""
    _, v = halted(parameters, coming(BodyKind.DRONE, 2.0), WALL, steps=30)
    assert v == pytest.approx((0.0, 0.0, 0.0), abs=1e-6)


@pytest.mark.parametrize("others", [(WALL,), (NEIGHBOUR,), (WALL, NEIGHBOUR)], ids=["wall", "drone", "both"])
def test_a_trapped_drone_gives_way_to_a_person_first(parameters, others):
    filtered, v = halted(parameters, coming(BodyKind.MOVER, 0.8), *others, steps=30)
    assert v[0] >= 0.8 - 1e-6
    assert (filtered.is_cornered, filtered.cornered) == (False, 1)  # once: it cannot be as fast at once


def test_between_a_wall_and_a_drone_the_wall_is_kept_clear_of(parameters):
    wall = Body(BodyKind.OBSTACLE, (0.53, 0.0, 0.0), 0.3)  # 0.1 m too near
    _, v = halted(parameters, wall, Body(BodyKind.DRONE, (-0.43, 0.0, 0.0), 0.0), steps=30)
    assert v[0] == pytest.approx(-0.1 * parameters.rate, abs=1e-6)


def test_a_drone_without_a_way_from_a_person_says_so(parameters):
    """At 9 m/s nobody gets away; each time is counted once."""
    filtered, _ = halted(parameters, coming(BodyKind.MOVER, 9.0), steps=5)
    assert (filtered.is_cornered, filtered.cornered) == (True, 1)
    filtered, _ = halted(parameters, coming(BodyKind.MOVER, 0.01))
    assert (filtered.is_cornered, filtered.cornered) == (False, 0)


def test_where_only_the_acceleration_forbids_it_goes_straight_to_what_satisfies_all(parameters):
    """Two bodies ahead, one of them much farther to the side: braking is best for both, not the way between them."""
    bodies = (Body(BodyKind.OBSTACLE, (0.7, 0.0, 0.0), 0.3), Body(BodyKind.OBSTACLE, (0.0, 0.62, 0.0), 0.3))
    last = (1.2, 1.2, 0.0)
    _, v = halted(parameters, *bodies, last=last)
    assert hypot(*(a - b for a, b in zip(v, last, strict=True))) == pytest.approx(0.1)
    x, y, _ = (a - b for a, b in zip(v, last, strict=True))
    free = (0.07 * parameters.rate, -0.01 * parameters.rate)
    assert x / y == pytest.approx((free[0] - 1.2) / (free[1] - 1.2), abs=1e-6)


def test_of_two_that_slip_past_each_other_neither_counts_on_what_the_other_has_not_seen(make_swarm):
    """One above the other, each bang-bang to the other side: 0.419 m with nothing violated."""
    swarm = make_swarm({"control.law": "extended", "limits.fence": {"min": [-9.0, -9.0, -9.0], "max": [9.0, 9.0, 9.0]}})
    parameters = replace(guard_parameters(swarm, 1), slowness=0.35, speed=1.05, floor=-8.0)
    nearest, period, across, push = 9.0, 0.57, 0.58, 1.6
    pair = [Slow((0.0, 0.0, 0.0), parameters), Slow((0.05, 0.0, 0.6), parameters)]
    for step in range(1, 400):
        at, here = step * SECOND // 100, [one.position for one in pair]
        for k, one in enumerate(pair):
            way = subtract(here[1 - k], here[k])
            side = across if (int(step * 0.01 / period + k) % 2) == k else -across
            one.command(add(scale(way, push / norm(way)), (0.0, side, 0.0)), way, at)
        for one in pair:
            one.fly()
        nearest = min(nearest, dist(pair[0].position, pair[1].position))
    assert nearest >= parameters.separation.drone - 0.002


class Slow:
    """A drone with 0.25 s of lag and 0.1 s of dead time, and its filter."""

    def __init__(self, position, parameters):
        self.position, self.velocity, self.last = position, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        self.queue, self.filtered, self.speed = [self.last] * 10, Guard(parameters), parameters.speed

    def command(self, wanted, other, at):
        """Take a step with another drone at `other`, relative."""
        stopping = add(self.position, scale(self.velocity, 0.25))
        for underway in self.queue:
            stopping = add(stopping, scale(underway, 0.01))
        motion = Motion(self.position, self.velocity, stopping)
        bodies = self.filtered.tracked(motion, (Body(BodyKind.DRONE, other, 0.0),), at)
        self.last = self.filtered.velocity(wanted, motion, bodies, at, at, self.last, 0.01, self.speed, False)

    def fly(self):
        """Fly on for 10 ms."""
        self.queue.append(self.last)
        self.velocity = add(self.velocity, scale(subtract(self.queue.pop(0), self.velocity), 1.0 - exp(-0.04)))
        self.position = add(self.position, scale(self.velocity, 0.01))
