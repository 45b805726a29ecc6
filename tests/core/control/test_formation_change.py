from math import pi

import numpy as np
import pytest
from flockwire_core.control.assignment import assignment
from flockwire_core.control.formation import Circle, FormationChange, blend, blend_rate, grid, line
from flockwire_core.domain.vector import distance, scale, subtract
from hypothesis import given
from hypothesis import strategies as st

COUNT = 6
shapes = st.one_of(
    st.builds(Circle, st.just(COUNT), st.floats(1.0, 4.0), st.floats(-1.0, 1.0)),
    st.builds(line, st.just(COUNT), st.floats(0.5, 2.0), st.floats(-pi, pi), st.floats(-0.5, 0.5)),
    st.builds(grid, st.just(COUNT), st.floats(0.5, 2.0), st.integers(1, 4), st.floats(-0.5, 0.5)),
)
ranks = st.permutations(range(COUNT)).map(tuple)
changes = st.builds(FormationChange, shapes, ranks, shapes, ranks, st.floats(0.0, 50.0), st.floats(0.5, 20.0))
indices = st.integers(0, COUNT - 1)


@given(changes, indices, st.floats(-0.5, 1.5))
def test_the_offset_rate_is_the_derivative_of_the_offset(change, index, s):
    t, step = change.begin + s * change.duration, 1e-5
    slope = scale(subtract(change.offset(index, t + step), change.offset(index, t - step)), 0.5 / step)
    assert change.offset_rate(index, t) == pytest.approx(slope, abs=1e-3)


@given(changes, indices)
def test_before_and_after_it_is_the_formation_of_then(change, index):
    early, late = change.begin - 0.3, change.begin + change.duration + 0.3
    assert change.offset(index, early) == change.before.offset(change.places_before[index], early)
    assert change.offset_rate(index, late) == change.after.offset_rate(change.places[index], late)


@given(changes, indices)
def test_neither_offset_nor_rate_jumps(change, index):
    """To within what the rate may change in 2 us."""
    for t in (change.begin, change.begin + change.duration):
        assert distance(change.offset(index, t - 1e-6), change.offset(index, t + 1e-6)) < 1e-4
        assert distance(change.offset_rate(index, t - 1e-6), change.offset_rate(index, t + 1e-6)) < 1e-4


def test_the_share_goes_from_0_to_1_and_begins_and_ends_gently():
    assert (blend(0.0), blend(0.5), blend(1.0)) == (0.0, 0.5, 1.0)
    assert (blend_rate(0.0), blend_rate(0.5), blend_rate(1.0)) == (0.0, 1.875, 0.0)


@given(st.data())
def test_ways_that_cross_least_keep_apart(data):
    """Of the smaller of both least distances, at least 1 / sqrt(2)."""
    count = data.draw(st.integers(2, 7))
    now, then = (
        np.array(
            data.draw(st.lists(st.tuples(*[st.integers(-20, 20)] * 3), min_size=count, max_size=count, unique=True))
        )
        for _ in range(2)
    )
    chosen = assignment(now.tolist(), then.tolist())
    assert sorted(chosen) == list(range(count))

    def least(points):
        gaps = np.linalg.norm(points[:, None] - points[None, :], axis=2)
        return gaps[~np.eye(count, dtype=bool)].min()

    bound = min(least(now), least(then)) / 2**0.5
    for sigma in np.linspace(0.0, 1.0, 21):
        assert least((1.0 - sigma) * now + sigma * then[list(chosen)]) >= bound - 1e-9
