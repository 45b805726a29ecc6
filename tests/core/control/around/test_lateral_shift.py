"""The lateral shift: outside the discs that the line crosses, with ramps no steeper than asked for."""

from __future__ import annotations

from math import cos, dist, sin

import pytest
from flockwire_core.control.around.lateral_shift import half_width, lateral_shift, rounded
from hypothesis import given
from hypothesis import strategies as st

ALONG = (1.0, 0.0)

lengths = st.floats(-5.0, 5.0)
radii = st.floats(0.1, 1.5)
slopes = st.floats(0.2, 20.0)
discs = st.lists(st.tuples(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0), radii), min_size=1, max_size=4)


@given(lengths, radii, slopes)
def test_a_disc_with_ramps_covers_the_disc_and_is_no_steeper_than_its_ramps(s: float, r: float, slope: float) -> None:
    width = half_width(s, r, slope)
    assert width >= (r * r - s * s) ** 0.5 - 1e-9 if abs(s) <= r else width <= r
    assert abs(half_width(s + 1e-4, r, slope) - width) <= 1e-4 * slope * (1.0 + 1e-6) + 1e-12


@given(st.floats(-1.0, 1.0))
def test_the_rounded_excess_is_never_less_than_it(x: float) -> None:
    assert rounded(x) >= max(x, 0.0)
    assert abs(rounded(x + 1e-5) - rounded(x)) <= 1e-5 * (1.0 + 1e-9)


@given(discs, lengths, lengths, st.sampled_from((-1.0, 1.0)), slopes)
def test_a_shifted_place_is_outside_all_discs_that_its_line_crosses(
    found: list[tuple[float, float, float]], x: float, y: float, side: float, slope: float
) -> None:
    shift, most = lateral_shift((x, y), ALONG, found, side, slope)
    assert 0.0 <= shift <= max(most, 0.0) + 0.0125 + 1e-9  # its rounding
    for cx, cy, r in found:
        if abs(y - cy) < r:
            assert dist((x, y + side * shift), (cx, cy)) >= r - 1e-9


@given(discs, lengths, lengths, st.sampled_from((-1.0, 1.0)), slopes, st.floats(0.0, 6.3))
def test_a_shift_depends_on_no_direction_of_the_axes(
    found: list[tuple[float, float, float]], x: float, y: float, side: float, slope: float, angle: float
) -> None:
    c, s = cos(angle), sin(angle)
    turned = [(c * a - s * b, s * a + c * b, r) for a, b, r in found]
    usual = lateral_shift((x, y), ALONG, found, side, slope)
    if all(abs(abs(y - cy) - r) > 1e-6 for _, cy, r in found):  # at its rim rounding decides
        assert (
            lateral_shift((c * x - s * y, s * x + c * y), (c, s), turned, side, slope)[1]
            == pytest.approx(usual[1], abs=1e-6)
            or len(found) > 1
        )


@given(lengths, st.floats(-0.9, 0.9), st.floats(0.0, 2.0), slopes)
def test_an_early_shift_is_the_same_only_earlier(s: float, aside: float, early: float, slope: float) -> None:
    disc = [(0.0, 0.0, 1.0)]
    shift, most = lateral_shift((s, aside), ALONG, disc, 1.0, slope, early)
    usual = s + early if s < -early else max(s, 0.0)
    assert (shift, most) == lateral_shift((usual, aside), ALONG, disc, 1.0, slope)


@pytest.mark.parametrize(("apart", "most"), [(0.3, 1.3), (0.5, 1.3), (0.8, 0.5), (3.0, 0.5)])
def test_a_disc_beside_the_line_counts_if_the_shift_would_lead_into_it(apart: float, most: float) -> None:
    found = [(2.0, 0.0, 0.5), (2.0 + apart, 0.8, 0.5)]
    assert lateral_shift((0.0, 0.0), ALONG, found, 1.0, 0.4)[1] == pytest.approx(most)
    assert lateral_shift((0.0, 0.0), ALONG, found, -1.0, 0.4)[1] == pytest.approx(0.5)


def test_a_row_of_discs_that_is_reached_one_after_the_other_is_no_wall() -> None:
    row = [(2.0 + 0.9 * k, 0.6 * k, 0.5) for k in range(5)]
    assert lateral_shift((0.0, 0.0), ALONG, row, 1.0, 1.0)[1] == pytest.approx(0.5)
