"""The nearest free place against a fine grid: none of its points is free and nearer."""

from __future__ import annotations

from math import dist, hypot, inf
from random import Random

import numpy as np
import pytest
from flockwire_core.control.fence import Room
from flockwire_core.control.free_place import Disc, is_free, nearest_free_place
from flockwire_core.control.plane_polygon import clearance

LOW, HIGH = (-1.0, -1.5, -0.5), (1.0, 1.5, 3.0)
BOX = Room(LOW, HIGH)
ELL = Room(
    (-9.0, -9.0, -0.5), (9.0, 9.0, 3.0), ((-1.0, -1.5), (1.0, -1.5), (1.0, 0.0), (0.0, 0.0), (0.0, 1.5), (-1.0, 1.5))
)
SPACING = 0.02  # m, of the grid


def nearest_on_grid(place: tuple[float, float], discs: list[Disc], room: Room) -> float:
    """Return the distance from `place` to the nearest point of the grid that is free."""
    x, y = np.meshgrid(np.arange(-1.0, 1.001, SPACING), np.arange(-1.5, 1.501, SPACING))
    free = np.ones(x.shape, dtype=bool)
    for cx, cy, r in discs:
        free &= np.hypot(x - cx, y - cy) >= r
    if room.corners:
        free &= ~((x > 0.0) & (y > 0.0))
    return float(np.hypot(x - place[0], y - place[1])[free].min(initial=inf))


@pytest.mark.parametrize("room", [BOX, ELL], ids=["box", "polygon"])
@pytest.mark.parametrize("seed", range(60))
def test_it_is_free_and_none_is_nearer(seed: int, room: Room) -> None:
    draw = Random(seed)
    place = (draw.uniform(-1.2, 1.2), draw.uniform(-1.7, 1.7))
    discs = [(draw.uniform(-1.2, 1.2), draw.uniform(-1.7, 1.7), draw.uniform(0.1, 0.6)) for _ in range(seed % 12)]
    found, least = nearest_free_place(place, discs, room), nearest_on_grid(place, discs, room)
    if found is None:
        assert least == inf
        return
    assert all(hypot(found[0] - x, found[1] - y) >= r - 1e-8 for x, y, r in discs)
    assert room.outside((*found, 1.0)) <= 1e-8
    assert dist(found, place) <= least + 1e-9


def test_a_free_place_is_its_own_nearest() -> None:
    assert nearest_free_place((0.3, 0.2), [], BOX) == (0.3, 0.2)
    assert nearest_free_place((0.3, 0.2), [(0.3, -0.5, 0.6)], BOX) == (0.3, 0.2)


def test_from_the_middle_of_a_disc_it_is_on_its_edge() -> None:
    found = nearest_free_place((0.2, 0.2), [(0.2, 0.2, 0.4)], BOX)
    assert found is not None
    assert dist(found, (0.2, 0.2)) == pytest.approx(0.4)


def test_in_a_room_that_is_covered_there_is_none() -> None:
    assert nearest_free_place((0.0, 0.0), [(0.1, 0.0, 3.0)], BOX) is None


def test_the_edge_of_a_disc_is_free() -> None:
    assert is_free((0.5, 0.0), [(0.0, 0.0, 0.5)])
    assert not is_free((0.499, 0.0), [(0.0, 0.0, 0.5)])


@pytest.mark.parametrize("room", [BOX, ELL], ids=["box", "polygon"])
def test_from_outside_it_is_in_the_room(room: Room) -> None:
    found = nearest_free_place((1.4, 0.5), [(1.0, 0.0, 0.3)], room)
    assert found is not None
    assert room.outside((*found, 0.0)) <= 1e-8
    if room.corners:
        assert clearance(room.corners, found)[0] == pytest.approx(0.0, abs=1e-8)
