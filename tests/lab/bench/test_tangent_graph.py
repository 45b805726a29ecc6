"""The tangent graph: ways are outside all discs, no longer than need be, equal for equal input, and bounded in cost."""

from __future__ import annotations

from math import asin, dist, sqrt

import pytest
import tangent_graph
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from tangent_graph import Disc, shortest_way

START, GOAL = (-2.5, 0.0), (2.5, 0.0)
STEP = 0.05  # m
discs = st.lists(st.tuples(st.floats(-1.8, 1.8), st.floats(-2.0, 2.0), st.floats(0.1, 0.6)), max_size=8)


def test_round_one_disc_it_is_two_tangents_and_an_arc() -> None:
    way = shortest_way((-2.0, 0.0), (2.0, 0.0), [(0.0, 0.0, 0.5)], STEP, 0.0)
    assert way is not None
    assert way.length == pytest.approx(2.0 * sqrt(4.0 - 0.25) + 0.5 * 2.0 * asin(0.25))


@given(around=discs)
@settings(max_examples=50)
def test_a_way_flown_step_by_step_stays_outside_and_arrives(around: list[Disc]) -> None:
    """A chord of STEP m cuts STEP² / 8 r from an arc."""
    way, here, flown = shortest_way(START, GOAL, around, STEP, 0.0), START, 0.0
    assume(way is not None)
    for _ in range(400):
        kept = [(x, y, min(r, dist(here, (x, y)) - 1e-3)) for x, y, r in around]
        way = shortest_way(here, GOAL, kept, STEP, 0.0)
        if way is None or way.length <= STEP:
            break
        flown, here = flown + dist(here, way.ahead), way.ahead
        assert all(dist(here, (x, y)) > r - 0.02 for x, y, r in around)
    assert way is None or dist(here, GOAL) <= STEP


@given(around=discs)
def test_equal_input_gives_equal_ways_no_shorter_than_the_straight_line(around: list[Disc]) -> None:
    way = shortest_way(START, GOAL, around, STEP, 0.1)
    assert way == shortest_way(START, GOAL, list(around), STEP, 0.1)
    assert way is None or way.length >= dist(START, GOAL) - 1e-9
    if not around:
        assert way is not None
        assert way.is_straight


def test_a_closed_ring_has_no_way() -> None:
    centers = ((1.0, 0.0), (0.5, 0.87), (-0.5, 0.87), (-1.0, 0.0), (-0.5, -0.87), (0.5, -0.87))
    assert shortest_way((0.0, 0.0), (3.0, 0.0), [(x, y, 0.55) for x, y in centers], STEP, 0.0) is None


@pytest.mark.sources  # replaces a compiled constant
def test_the_search_ends_at_its_most_expansions(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tangent_graph, "MOST_EXPANSIONS", 2)
    wall = [(0.0, 0.4 * k, 0.3) for k in range(-5, 6)]
    assert shortest_way(START, GOAL, wall, STEP, 0.0) is None
    monkeypatch.undo()
    assert shortest_way(START, GOAL, wall, STEP, 0.0) is not None
