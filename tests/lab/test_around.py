"""Drones get round what is in their way: some flights of lab/bench/ways.py, by their bars."""

from __future__ import annotations

from typing import Any

import pytest
from settling import IDEAL, TELLO
from ways import fly


@pytest.mark.parametrize(("number", "airframe"), [(3, TELLO), pytest.param(0, IDEAL, marks=pytest.mark.long)])
def test_a_place_that_crosses_an_obstacle_costs_little_more_than_the_shortest_detour(
    number: int, airframe: dict[str, Any]
) -> None:
    assert fly("crossing", number, airframe).why == []


@pytest.mark.long
@pytest.mark.parametrize(
    ("family", "number"),
    [("corridor", 1), ("swap", 3), ("person", 1), ("obstacles", 0)],
    ids=["four exchange sides through a narrow gap", "twelve exchange sides", "a person", "obstacles"],
)
def test_nobody_waits_for_ever(family: str, number: int) -> None:
    """In the corridor two of four mirrored each other's way without end, before sides were kept longer each time."""
    assert fly(family, number, TELLO).why == []
