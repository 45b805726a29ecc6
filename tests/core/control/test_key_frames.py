import pytest
from flockwire_core.control.key_frames import KeyFrames, parse_key_frames
from flockwire_core.domain.vector import ZERO, scale, subtract
from hypothesis import given
from hypothesis import strategies as st

TEXT = """t,drone,x,y,z
0,1,0,0,0
0,2,1,0,0

2, 1, 1, 1, 0.5
4,1,1,1,0.5
6,1,-1,2,0
5,2,1,3,0
"""
coordinates = st.floats(-10.0, 10.0)
frames = st.lists(
    st.tuples(st.floats(0.2, 5.0), st.tuples(coordinates, coordinates, coordinates)), min_size=1, max_size=6
)


@st.composite
def key_frames(draw):
    track = draw(frames)
    times = tuple(sum(span for span, _ in track[: k + 1]) for k in range(len(track)))
    return KeyFrames((times,), (tuple(place for _, place in track),))


def test_parsing_sorts_the_rows_by_drone():
    parsed = parse_key_frames(TEXT)
    assert parsed.count == 2
    assert parsed.times == ((0.0, 2.0, 4.0, 6.0), (0.0, 5.0))
    assert parsed.offsets[1] == ((1.0, 0.0, 0.0), (1.0, 3.0, 0.0))


def test_the_offset_passes_through_the_frames_and_is_held_outside():
    parsed = parse_key_frames(TEXT)
    for t, place in zip(parsed.times[0], parsed.offsets[0], strict=True):
        assert parsed.offset(0, t) == pytest.approx(place)
    assert parsed.offset(1, -1.0) == (1.0, 0.0, 0.0)
    assert parsed.offset(1, 99.0) == (1.0, 3.0, 0.0)
    assert parsed.offset_rate(1, -1.0) == parsed.offset_rate(1, 0.0) == parsed.offset_rate(1, 5.0) == ZERO


def test_equal_frames_are_a_rest():
    parsed = parse_key_frames(TEXT)
    assert parsed.offset(0, 3.1) == pytest.approx((1.0, 1.0, 0.5))
    assert parsed.offset_rate(0, 3.1) == pytest.approx(ZERO)


@given(key_frames(), st.floats(-1.0, 32.0))
def test_the_offset_rate_is_the_derivative_of_the_offset(formation, t):
    step = 1e-6
    slope = scale(subtract(formation.offset(0, t + step), formation.offset(0, t - step)), 0.5 / step)
    assert formation.offset_rate(0, t) == pytest.approx(slope, abs=0.01)


@given(key_frames())
def test_offset_and_rate_are_continuous_at_the_frames(formation):
    for t in formation.times[0]:
        for curve in (formation.offset, formation.offset_rate):
            assert curve(0, t - 1e-9) == pytest.approx(curve(0, t), abs=1e-4)


@given(key_frames(), st.floats(0.0, 1.0), st.integers(0, 5))
def test_the_offset_stays_in_the_box_of_two_frames(formation, share, k):
    (times,), (places,) = formation.times, formation.offsets
    k %= len(times)
    end = min(k + 1, len(times) - 1)
    place = formation.offset(0, times[k] + share * (times[end] - times[k]))
    for value, a, b in zip(place, places[k], places[end], strict=True):
        assert min(a, b) - 1e-9 <= value <= max(a, b) + 1e-9


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "line 1: header is ''"),
        ("t,x,y,z\n", "line 1: header is 't,x,y,z', it must be 't,drone,x,y,z'"),
        ("t,drone,x,y,z\n", "line 1: no key frame follows the header"),
        ("t,drone,x,y,z\n0,1,0,0\n", "line 2: 4 values, there must be 5"),
        ("t,drone,x,y,z\n0,0,0,0,0\n", "line 2: drone = '0' must be a whole number from 1"),
        ("t,drone,x,y,z\n0,1.5,0,0,0\n", "line 2: drone = '1.5' must be a whole number"),
        ("t,drone,x,y,z\n0,1,0,up,0\n", "line 2: y = 'up' must be a finite number"),
        ("t,drone,x,y,z\nnan,1,0,0,0\n", "line 2: t = 'nan' must be a finite number"),
        ("t,drone,x,y,z\n\n1,1,0,0,0\n1,1,1,0,0\n", "line 4: t = 1 must be later than drone 1's last frame, 1"),
        ("t,drone,x,y,z\n0,1,0,0,0\n0,3,0,0,0\n", "drone = 3 has key frames, drone = 2 none"),
    ],
)
def test_a_wrong_table_is_refused_with_line_value_and_rule(text, message):
    with pytest.raises(ValueError) as refusal:
        parse_key_frames(text)
    assert message in str(refusal.value)


def test_foreign_line_ends_are_ignored():
    assert parse_key_frames("t,drone,x,y,z\r\n0,1,1,2,3\r\n").offset(0, 7.0) == (1.0, 2.0, 3.0)
