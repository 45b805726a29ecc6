"""Which estimate contradicts the others: one false one of three is found, whatever it is, and no honest one."""

from __future__ import annotations

import pytest
from flockwire_core.pilot.agreement import contradicting, is_decided
from hypothesis import given
from hypothesis import strategies as st

BOUND = 0.3
NEAR = st.tuples(*[st.floats(-0.08, 0.08)] * 3)  # two such are less than BOUND apart
FAR = st.tuples(*[st.floats(-50.0, 50.0)] * 3)


@given(st.lists(NEAR, min_size=2, max_size=6), FAR)
def test_one_false_estimate_never_has_an_honest_one_left_out(honest, false):
    positions = dict(enumerate([*honest, false], 1))
    left_out = contradicting(positions, BOUND, 0)
    if max(map(abs, false)) > 1.0:
        assert left_out == (len(positions),)
    assert set(left_out) <= {len(positions)}
    assert is_decided(positions, left_out, 0)


@given(st.lists(FAR, min_size=1, max_size=4))
def test_the_leaders_own_position_is_believed_against_any_number(false):
    positions = {0: (0.0, 0.0, 0.0), **dict(enumerate(false, 1))}
    left_out = contradicting(positions, BOUND, 0)
    assert 0 not in left_out
    assert is_decided(positions, left_out, 0)
    assert all(max(map(abs, positions[j])) <= BOUND for j in positions if j not in left_out)


@pytest.mark.parametrize(
    ("xs", "left_out", "decided"),
    [((0.0, 0.29), (), True), ((0.0, 0.31), (1, 2), False), ((0.0, 1.0, 2.0), (1, 3), False)],
)
def test_without_a_majority_nobody_is_believed(xs, left_out, decided):
    positions = {j: (x, 0.0, 1.0) for j, x in enumerate(xs, 1)}
    assert contradicting(positions, BOUND, 0) == left_out
    assert is_decided(positions, left_out, 0) == decided
