import pytest
from flockwire_tello.state_string import LONGEST, MissionPad, TelloState, format_state, parse_states
from hypothesis import given
from hypothesis import strategies as st

PLAIN = (
    b"pitch:0;roll:-1;yaw:21;vgx:0;vgy:-3;vgz:0;templ:84;temph:87;tof:10;h:0;bat:100;baro:94.48;time:50;"
    b"agx:-10.00;agy:16.00;agz:-999.00;\r\n"
)
EDU = b"mid:-1;x:-100;y:-100;z:-100;mpry:-1,-1,-1;" + PLAIN
SHORT = b"pitch:0;roll:-1;yaw:21;vgx:0;vgy:-3;vgz:0;templ:84;temph:87;tof:10;h:0;bat:100;baro:94.48;\r\n"
STATE = TelloState(0, -1, 21, 0, -3, 0, 84, 87, 10, 0, 100, 94.48, 50, -10.0, 16.0, -999.0)
PAD = MissionPad(-1, -100, -100, -100, (-1, -1, -1))

whole = st.integers(-999_999_999, 999_999_999)
hundredths = st.integers(-9_999_999, 9_999_999).map(lambda n: n / 100)
pads = st.builds(MissionPad, whole, whole, whole, whole, st.tuples(whole, whole, whole))
states = st.builds(
    TelloState,
    *[whole] * 11,
    baro=hundredths,
    time=st.none() | whole,
    agx=st.none() | hundredths,
    agy=st.none() | hundredths,
    agz=st.none() | hundredths,
    pad=st.none() | pads,
)


@pytest.mark.parametrize(
    ("datagram", "state"),
    [
        (PLAIN, STATE),
        (EDU, STATE._replace(pad=PAD)),
        (SHORT, STATE._replace(time=None, agx=None, agy=None, agz=None)),
    ],
    ids=["SDK 1.3", "EDU", "SDK 3.0 guide"],
)
def test_all_generations_are_read_and_written(datagram, state):
    assert parse_states(datagram) == ([state], 0)
    assert format_state(state) == datagram


@given(states)
def test_what_is_formatted_is_parsed(state):
    assert parse_states(format_state(state)) == ([state], 0)


def test_several_strings_in_a_datagram_come_oldest_first():
    newer = STATE._replace(bat=99)
    joined = format_state(STATE) + format_state(newer)
    assert parse_states(joined) == ([STATE, newer], 0)
    assert parse_states(joined.replace(b"\r\n", b"")) == ([STATE, newer], 0)


def test_unknown_fields_are_ignored():
    assert parse_states(b"new:1,2;" + PLAIN.replace(b"bat", b"extra;other:x;bat")) == ([STATE], 0)


@pytest.mark.parametrize(
    "datagram",
    [
        PLAIN.replace(b"bat:100;", b""),
        PLAIN.replace(b"bat:100", b"bat:full"),
        PLAIN.replace(b"bat:100", b"bat:"),
        PLAIN.replace(b"94.48", b"nan"),
        PLAIN.replace(b"94.48", b"1e9"),
        PLAIN.replace(b"bat:100", b"bat:1_0"),
        PLAIN.replace(b"bat:100", b"bat:" + b"9" * 400),
        EDU.replace(b"-1,-1,-1", b"-1,-1"),
        b"ok",
        b"x" * (LONGEST + 1),
    ],
)
def test_a_malformed_string_is_counted_and_dropped(datagram):
    assert parse_states(datagram) == ([], 1)


def test_a_malformed_string_does_not_take_the_next_with_it():
    assert parse_states(PLAIN.replace(b"100", b"?") + PLAIN) == ([STATE], 1)


@given(st.binary(max_size=400) | st.binary(max_size=60).map(lambda junk: junk.join([PLAIN[:50], PLAIN[50:]])))
def test_no_datagram_raises(datagram):
    found, malformed = parse_states(datagram)
    assert len(found) + malformed <= len(datagram)
