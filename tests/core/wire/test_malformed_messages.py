"""Whatever arrives, decode returns a message or raises MessageError, soon."""

import time
from struct import pack

import pytest
from flockwire_core.domain.airframe import Command, FlightState, Telemetry
from flockwire_core.domain.body import Body, BodyKind, Nearby
from flockwire_core.domain.motion import Estimate, LeaderMotion, Leading
from flockwire_core.domain.order import Change, Mission, Stop
from flockwire_core.domain.pose import Pose
from flockwire_core.wire.cdr import HEADER, LONGEST_SEQUENCE, MessageError
from flockwire_core.wire.codec import decode, encode
from flockwire_core.wire.status import Report, Status
from hypothesis import given
from hypothesis import strategies as st

STAMP, PLACE = 1_790_000_000_123_456_789, (1.0, -2.0, 3.0)
SOUND = (
    Pose(STAMP, "world", PLACE),
    Estimate(STAMP, "world", LeaderMotion(PLACE, PLACE, PLACE), STAMP - 5, 2, Leading.LEADS),
    Command(STAMP, "world", PLACE),
    Nearby(STAMP, "world", (Body(BodyKind.DRONE, PLACE, 0.0), Body(BodyKind.OBSTACLE, PLACE, 0.2))),
    Telemetry(STAMP, "world", FlightState.FLYING, 0.9, 1.0, 0.01),
    Mission(STAMP, "world", "start", STAMP, "line"),
    Stop(STAMP, "world", "why"),
    Status(STAMP, "world", "uav1", Report("hold"), 1, 2, 3, 4, 5, 0.5, 6, (("a", 1),), ("gateway", "uav2")),
)
CHANGE = Change(STAMP, 2.0, "", (0, 1, 2), (2, 0, 1))
KINDS = tuple(type(message) for message in SOUND)
each = pytest.mark.parametrize("message", SOUND, ids=lambda m: type(m).__name__)


def changed(**fields):
    return Mission(STAMP, "world", "formation", STAMP, "line", CHANGE._replace(**fields))


def refused_or_sound(kind, data):
    """Return whether `data` is refused with MessageError, or read as a message that can be sent on unchanged."""
    try:
        message = decode(kind, data)
    except MessageError:
        return True
    return decode(kind, encode(message)) == message


@given(st.binary(max_size=300), st.booleans())
def test_random_bytes_are_harmless(data, headed):
    for kind in KINDS:
        assert refused_or_sound(kind, HEADER + data if headed else data)


@each
def test_every_truncation_is_refused(message):
    whole = encode(message)
    for length in range(len(whole)):
        with pytest.raises(MessageError):
            decode(type(message), whole[:length])


@each
@given(data=st.data())
def test_a_mutated_message_is_harmless(message, data):
    raw = bytearray(encode(message))
    for _ in range(data.draw(st.integers(1, 4))):
        raw[data.draw(st.integers(0, len(raw) - 1))] = data.draw(st.integers(0, 255))
    assert refused_or_sound(type(message), bytes(raw))


@each
def test_every_single_byte_may_be_the_largest_or_the_smallest(message):
    whole = encode(message)
    for place in range(len(whole)):
        for value in (0x00, 0x7F, 0x80, 0xFF):
            assert refused_or_sound(type(message), whole[:place] + bytes([value]) + whole[place + 1 :])


@each
def test_a_word_of_any_size_at_any_place_is_harmless(message):
    whole = encode(message)
    for place in range(4, len(whole) - 3, 4):
        for count in (0, 1, LONGEST_SEQUENCE + 1, 2**31 - 1, 2**31, 2**32 - 1):
            assert refused_or_sound(type(message), whole[:place] + pack("<I", count) + whole[place + 4 :])


@pytest.mark.parametrize("count", [1, 900, LONGEST_SEQUENCE, LONGEST_SEQUENCE + 1, 2**32 - 1])
def test_a_claim_of_many_bodies_is_refused_at_once(count):
    claim = encode(Nearby(STAMP, "a_frame_of_its_own", ()))[:-4] + pack("<I", count)
    began = time.process_time()
    with pytest.raises(MessageError):
        decode(Nearby, claim)
    assert time.process_time() - began < 0.05


@pytest.mark.parametrize("wrong", [float("nan"), float("inf"), float("-inf")])
def test_numbers_that_are_not_finite_are_refused(wrong):
    pose, estimate, command, nearby, telemetry, _, _, status = SOUND
    for place in ((wrong, 0.0, 0.0), (0.0, wrong, 0.0), (0.0, 0.0, wrong), (wrong, -wrong, 0.0)):
        for message in (
            pose._replace(position=place),
            pose._replace(orientation=(*place, 1.0)),
            estimate._replace(motion=estimate.motion._replace(position=place)),
            estimate._replace(motion=estimate.motion._replace(velocity=place)),
            command._replace(velocity=place),
            nearby._replace(bodies=(Body(BodyKind.DRONE, place, 0.0),)),
        ):
            with pytest.raises(MessageError, match="not finite"):
                decode(type(message), encode(message))
    for message in (
        command._replace(yaw_rate=wrong),
        nearby._replace(bodies=(Body(BodyKind.DRONE, PLACE, wrong),)),
        telemetry._replace(battery=wrong),
        telemetry._replace(height=wrong),
        telemetry._replace(command_age=wrong),
        status._replace(cpu=wrong),
        status._replace(report=Report("hold", formation_error=wrong)),
        status._replace(report=Report("hold", battery=wrong)),
        status._replace(report=Report("hold", latency=wrong)),
    ):
        with pytest.raises(MessageError, match="not finite"):
            decode(type(message), encode(message))


@pytest.mark.parametrize(
    ("message", "rule"),
    [
        (Nearby(STAMP, "world", (Body(BodyKind.DRONE, PLACE, -0.1),)), "radius -0.1"),
        (Mission(STAMP, "world", "dance"), "no mission 'dance'"),
        (changed(places=(0, 1, 1)), "two have one place"),
        (changed(places=(0, 1, 3)), "two have one place"),
        (changed(places_before=(2, 1, 2)), "two have one place"),
        (changed(places_before=(0, 1)), "two have one place"),
        (changed(duration=0.0), "takes 0.0 s"),
        (changed(duration=601.0), "takes 601.0 s"),
    ],
)
def test_content_that_means_nothing_is_refused(message, rule):
    with pytest.raises(MessageError, match=rule):
        decode(type(message), encode(message))


def alternatives():
    """Return messages with two states of an enumeration, and what the number 9 in their place says."""
    motion = LeaderMotion(PLACE, PLACE, PLACE)
    kinds, states, leading = (list(each)[:2] for each in (BodyKind, FlightState, Leading))
    return (
        ([Nearby(STAMP, "world", (Body(kind, PLACE, 0.0),)) for kind in kinds], "no body of kind 9"),
        ([Telemetry(STAMP, "world", state, 0.9, 1.0, 0.0) for state in states], "no flight state 9"),
        ([Estimate(STAMP, "world", motion, STAMP, 2, state) for state in leading], "no state 9 of a leader"),
    )


@pytest.mark.parametrize(("messages", "rule"), alternatives())
def test_a_number_that_no_enumeration_has_is_refused(messages, rule):
    one, other = map(encode, messages)
    (at,) = (i for i, pair in enumerate(zip(one, other, strict=True)) if pair[0] != pair[1])
    with pytest.raises(MessageError, match=rule):
        decode(type(messages[0]), one[:at] + b"\x09" + one[at + 1 :])


@each
def test_more_than_padding_behind_a_message_is_refused(message):
    with pytest.raises(MessageError, match="left over"):
        decode(type(message), encode(message) + bytes(4))


@each
def test_a_second_of_more_than_a_billion_nanoseconds_is_refused(message):
    whole = encode(message)
    with pytest.raises(MessageError):
        decode(type(message), whole[:8] + pack("<I", 1_000_000_000) + whole[12:])


@each
@pytest.mark.parametrize("frame", [b"\6\0\0\0worldX", b"\6\0\0\0wor\xff\xfe\0", b"\0\0\0\0"])
def test_a_broken_frame_id_is_refused(message, frame):
    whole = encode(message)
    with pytest.raises(MessageError):
        decode(type(message), whole[:12] + frame + whole[22:])
