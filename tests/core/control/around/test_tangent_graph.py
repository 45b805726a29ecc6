"""The tangent graph: its way is outside all discs, and no sampled way is shorter."""

from __future__ import annotations

from heapq import heappop, heappush
from math import asin, cos, dist, hypot, inf, pi, sin, sqrt, tau

import pytest
from flockwire_core.control.around import tangent_graph
from flockwire_core.control.around.tangent_graph import Way, shortest_way, tangent
from flockwire_core.control.free_place import Disc, is_free
from hypothesis import assume, given, settings
from hypothesis import strategies as st

Point = tuple[float, float]

coordinates = st.floats(-3.0, 3.0)
circles = st.tuples(coordinates, coordinates, st.floats(-1.0, 1.0))
discs = st.lists(st.tuples(coordinates, coordinates, st.floats(0.2, 1.0)), min_size=1, max_size=5)
START, GOAL = (-3.5, 0.0), (3.5, 0.0)


@given(circles, circles)
def test_a_tangent_touches_both_circles_at_right_angles_on_their_sides(one: Disc, other: Disc) -> None:
    edge = tangent(one, other)
    if edge is None:
        assert hypot(one[0] - other[0], one[1] - other[1]) <= abs(one[2] - other[2]) + 1e-9
        return
    ax, ay, bx, by, ux, uy = edge
    assert hypot(ux, uy) == pytest.approx(1.0)
    for (cx, cy, r), (x, y) in ((one, (ax, ay)), (other, (bx, by))):
        assert (cx - x) * ux + (cy - y) * uy == pytest.approx(0.0, abs=1e-6)
        assert ux * (cy - y) - uy * (cx - x) == pytest.approx(r, abs=1e-6)  # > 0: the centre lies to the left


def test_round_one_disc_it_is_two_tangents_and_an_arc() -> None:
    way = shortest_way((-2.0, 0.0), (2.0, 0.0), [(0.0, 0.0, 1.0)], 0.5)
    assert way is not None
    assert way.length == pytest.approx(2.0 * sqrt(3.0) + pi - 2.0 * asin(sqrt(0.75)))
    assert way.ahead == pytest.approx((-2.0 + 0.5 * cos(pi / 6), 0.5 * sin(pi / 6))) or way.ahead[1] < 0.0


def free(a: Point, b: Point, found: list[Disc]) -> bool:
    count = 1 + int(dist(a, b) / 0.02)
    return all(
        is_free((a[0] + k / count * (b[0] - a[0]), a[1] + k / count * (b[1] - a[1])), found) for k in range(count)
    )


def sampled(found: list[Disc]) -> float:
    """Return the length of the shortest way over points a little outside of the circles."""
    points = [START, GOAL]
    points += [
        (x + 1.05 * r * cos(a), y + 1.05 * r * sin(a)) for x, y, r in found for a in (tau * k / 12 for k in range(12))
    ]
    points, queue, done = [p for p in points if is_free(p, found)], [(0.0, START)], set[Point]()
    while queue:
        length, at = heappop(queue)
        if at == GOAL:
            return length
        if at not in done:
            done.add(at)
            for p in points:
                if p not in done and free(at, p, found):
                    heappush(queue, (length + dist(at, p), p))
    return inf


@settings(max_examples=15, deadline=None)
@given(discs)
def test_no_sampled_way_is_shorter(found: list[Disc]) -> None:
    assume(is_free(START, found) and is_free(GOAL, found))
    way, other = shortest_way(START, GOAL, found, 0.3), sampled(found)
    if way is None:
        assert other == inf
    else:
        assert dist(START, GOAL) - 1e-9 <= way.length <= other + 1e-6
        assert (not way.side) == (way.length <= dist(START, GOAL) + 1e-9)


@given(discs, st.floats(0.1, 3.0))
def test_what_is_flown_to_shortens_the_way_by_as_much_as_is_flown(found: list[Disc], ahead: float) -> None:
    assume(is_free(START, found) and is_free(GOAL, found))
    way = shortest_way(START, GOAL, found, ahead)
    if way is None:
        return
    part = 0.001 / ahead
    assert dist(START, way.ahead) == pytest.approx(ahead)
    there = (START[0] + part * (way.ahead[0] - START[0]), START[1] + part * (way.ahead[1] - START[1]))
    rest = shortest_way(there, GOAL, found, ahead)
    assert rest is not None
    assert rest.length == pytest.approx(way.length - 0.001, abs=1e-5)


@given(discs)
def test_a_way_flown_step_by_step_stays_outside_and_arrives(found: list[Disc]) -> None:
    """A chord of 0.05 m cuts 0.05² / 8 r from an arc."""
    assume(is_free(START, found) and is_free(GOAL, found))
    way, here = shortest_way(START, GOAL, found, 0.05), START
    assume(way is not None)
    for _ in range(400):
        kept = [(x, y, min(r, dist(here, (x, y)) - 1e-5)) for x, y, r in found]
        way = shortest_way(here, GOAL, kept, 0.05)
        if way is None or way.length <= 0.05:
            break
        here = way.ahead
        assert all(dist(here, (x, y)) > r - 0.02 for x, y, r in found)
    assert way is None or dist(here, GOAL) <= 0.05


@given(discs)
def test_who_is_there_stays(found: list[Disc]) -> None:
    assert shortest_way(START, START, found, 0.3, 0.1, (0.1, 0.0)) == Way(0.0, START, 0.0)


def test_a_way_with_its_disc_to_the_right_costs_more() -> None:
    disc = (0.0, -0.1, 0.5)  # the shorter way has it there
    free, cheap, dear = (shortest_way(START, GOAL, [disc], 0.3, right) for right in (0.0, 0.003, 0.3))
    assert free is not None
    assert cheap is not None
    assert dear is not None
    assert (free.side, cheap.side, dear.side) == (-1.0, -1.0, 1.0)
    assert cheap.length == pytest.approx(free.length + 0.003)
    assert free.length < dear.length < free.length + 0.3


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_to_turn_costs_by_its_angle(side: float) -> None:
    disc = (0.0, 0.1 * side, 0.5)  # the shorter way has it on this side
    free, cheap, dear = (shortest_way(START, GOAL, [disc], 0.3, 0.0, (0.0, turn * side)) for turn in (0.0, 0.01, 0.5))
    assert free is not None
    assert cheap is not None
    assert dear is not None
    assert (free.side, cheap.side, dear.side) == (side, side, -side)
    cosine = side * (free.ahead[1] - START[1]) / 0.3
    assert cheap.length == pytest.approx(free.length + 0.01 * (1.0 - cosine))


def test_a_closed_ring_has_no_way() -> None:
    centers = ((1.0, 0.0), (0.5, 0.87), (-0.5, 0.87), (-1.0, 0.0), (-0.5, -0.87), (0.5, -0.87))
    assert shortest_way((0.0, 0.0), (3.0, 0.0), [(x, y, 0.55) for x, y in centers], 0.3) is None


@pytest.mark.sources  # replaces a compiled constant
def test_the_search_ends_at_its_most_expansions(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tangent_graph, "MOST_EXPANSIONS", 2)
    wall = [(0.0, 0.4 * k, 0.3) for k in range(-5, 6)]
    assert shortest_way(START, GOAL, wall, 0.3) is None
    monkeypatch.undo()
    assert shortest_way(START, GOAL, wall, 0.3) is not None
