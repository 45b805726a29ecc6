"""The grid finds whom looking at all would find, in the same order."""

from __future__ import annotations

from math import dist

from flockwire_mocap.vicinity import Vicinity
from hypothesis import given
from hypothesis import strategies as st

coordinate = st.floats(-6.0, 6.0)
places = st.dictionaries(st.integers(0, 99), st.tuples(coordinate, coordinate, coordinate), max_size=40)


@given(places, st.tuples(coordinate, coordinate, coordinate), st.floats(0.1, 3.0))
def test_the_grid_finds_what_looking_at_all_finds(
    places: dict[int, tuple[float, float, float]], position: tuple[float, float, float], reach: float
) -> None:
    found = [key for key in Vicinity(places, reach).round(position) if dist(places[key], position) < reach]
    assert found == [key for key, place in places.items() if dist(place, position) < reach]
