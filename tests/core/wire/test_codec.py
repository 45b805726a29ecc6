"""Round trips, and the codec against rosbags, an independent implementation of CDR."""

import numpy as np
import pytest
from flockwire_core.domain.airframe import Command, FlightState, Steer, Telemetry
from flockwire_core.domain.body import Body, BodyKind, Nearby
from flockwire_core.domain.motion import Estimate, LeaderMotion, Leading
from flockwire_core.domain.order import LONGEST_CHANGE, MISSION_VERBS, Change, Mission, Stop
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND, TimeReply, TimeRequest
from flockwire_core.wire.cdr import MessageError
from flockwire_core.wire.codec import decode, encode
from flockwire_core.wire.keys import TABLE
from flockwire_core.wire.schemas import DEFINITIONS, ROS_TYPES, schema_text
from flockwire_core.wire.status import Reason, Report, Status
from hypothesis import given
from hypothesis import strategies as st
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

ROS = get_typestore(Stores.EMPTY)
for name, definition in DEFINITIONS.items():
    ROS.register(get_types_from_msg(definition, name))
T = {name.rpartition("/")[2]: kind for name, kind in ROS.types.items()}

stamps = st.integers(-(2**31) * SECOND, 2**31 * SECOND - 1)
frames = st.text(max_size=20)
numbers = st.floats(-1e12, 1e12)
vectors = st.tuples(numbers, numbers, numbers)
counts = st.integers(0, 2**64 - 1)
bodies = st.builds(Body, st.sampled_from(BodyKind), vectors, st.floats(0.0, 1e3), vectors)
changes = st.integers(1, 20).flatmap(
    lambda count: st.builds(
        Change, stamps, st.floats(1e-3, LONGEST_CHANGE), st.text(),
        st.permutations(range(count)).map(tuple), st.permutations(range(count)).map(tuple),
    )
)  # fmt: skip
absent = st.lists(st.integers(0, 999), max_size=4).map(tuple)
givers = st.integers(0, 2**32 - 1)
versions = st.lists(st.tuples(stamps, givers), max_size=4).map(tuple)
orders = st.builds(
    Mission, stamps.filter(bool), st.just("world"), st.text(), stamps, st.text(), st.none() | changes, absent,
    givers, counts, versions, st.just(0),
)  # fmt: skip
short = st.text(max_size=60)  # a longer text of a status is shortened
reports = st.builds(
    Report, short, short, numbers, numbers, numbers, numbers, numbers, numbers, st.none() | orders,
    latency=numbers, counts=st.lists(st.tuples(short, counts), max_size=3).map(tuple),
    position=st.none() | vectors, unnumbered=versions, order_age=numbers,
    reasons=st.lists(st.builds(Reason, short, short, short), max_size=3).map(tuple),
    place=st.none() | st.integers(0, 2**31 - 1),
    code=short,
)  # fmt: skip
MESSAGES = (
    st.builds(Pose, stamps, frames, vectors, st.tuples(numbers, numbers, numbers, numbers)),
    st.builds(
        Estimate, stamps, frames, st.builds(LeaderMotion, vectors, vectors, vectors), stamps, st.integers(0, 255),
        st.sampled_from(Leading),
    ),
    st.builds(Command, stamps, frames, vectors, numbers, vectors),
    st.builds(Steer, stamps, frames, vectors),
    st.builds(Nearby, stamps, frames, st.lists(bodies, max_size=6).map(tuple)),
    st.builds(Telemetry, stamps, frames, st.sampled_from(FlightState), numbers, numbers, numbers, st.booleans()),
    st.builds(
        Mission, stamps, frames, st.sampled_from(MISSION_VERBS), stamps, st.text(), st.none() | changes, absent,
        givers, counts, versions, st.just(0),
    ),
    st.builds(Stop, stamps, frames, st.text()),
    st.builds(
        Status, stamps, st.just("world"), short, reports, counts, counts, counts, counts, counts, numbers, counts,
        st.lists(st.tuples(short, counts), max_size=3).map(tuple), st.lists(short, max_size=3).map(tuple),
        numbers, numbers,
    ),
    st.builds(TimeRequest, stamps, frames),
    st.builds(TimeReply, stamps, frames, stamps, stamps),
)  # fmt: skip
messages = st.one_of(MESSAGES)

REASONS = (Reason("firmware", "SDK 20"), Reason("IMU", "a tilt of 25 degrees", "put it level"))


def ros_time(stamp):
    return T["Time"](*divmod(stamp, SECOND))


def ros_content(message):  # noqa: PLR0911 (one for each kind)
    """Return what follows the header of a message's ROS 2 twin."""
    point, vector = (lambda v: T["Point"](*v)), (lambda v: T["Vector3"](*v))
    match message:
        case Pose():
            return (T["Pose"](point(message.position), T["Quaternion"](*message.orientation)),)
        case Estimate():
            return (
                point(message.motion.position), *map(vector, message.motion.fields()[1:]),
                ros_time(message.origin), message.hops, message.leading,
            )  # fmt: skip
        case Command():
            turning = vector((0.0, 0.0, message.yaw_rate))
            return (T["Twist"](vector(message.velocity), turning), vector(message.acceleration))
        case Steer():
            return (T["Twist"](vector(message.velocity), vector((0.0, 0.0, 0.0))),)
        case Nearby():
            return (
                [
                    T["NearbyBody"](b.kind, vector(b.relative_position), b.radius, vector(b.velocity))
                    for b in message.bodies
                ],
            )
        case Telemetry():
            return (message.state, message.battery, message.height, message.command_age, message.stop_received)
        case Mission():
            return (message.verb, *ros_formation(message))
        case Stop():
            return (message.reason,)
        case TimeRequest():
            return ()
        case TimeReply():
            return (ros_time(message.requested), ros_time(message.received))
        case Status():
            r, order = message.report, message.report.mission or Mission(0, "", "")
            return (
                message.identity, r.phase, r.detail, r.formation_error, r.pose_age, r.estimate_age, r.nearby_age,
                r.telemetry_age, r.battery, message.cpu, message.steps, message.delayed_1ms, message.delayed_5ms,
                message.skipped, message.refused, message.resident, [key for key, _ in message.rejected],
                np.array([count for _, count in message.rejected], dtype=np.uint64), list(message.links),
                r.latency, [name for name, _ in r.counts], np.array([n for _, n in r.counts], dtype=np.uint64),
                ros_time(order.stamp), order.verb, *ros_formation(order),
                r.position is not None, T["Point"](*(r.position or (0.0, 0.0, 0.0))),
                message.clock_offset, message.clock_bound,
                ros_versions(r.unnumbered), r.order_age, [T["Reason"](*reason) for reason in r.reasons],
                -1 if r.place is None else r.place, r.code,
            )  # fmt: skip
    raise AssertionError(message)


def ros_formation(order):
    begin, duration, before, places_before, places = order.change or Change(0, 0.0, "", (), ())
    ranks = [np.array(each, dtype=np.uint16) for each in (places_before, places, order.without)]
    changed = (ros_time(order.start), order.formation, ros_time(begin), duration, before)
    return (*changed, *ranks, order.giver, order.number, ros_versions(order.downs))


def ros_versions(versions):
    return [T["OrderVersion"](ros_time(stamp), giver) for stamp, giver in versions]


def ros_bytes(message):
    header = T["Header"](ros_time(message.stamp), message.frame)
    twin = ROS.types[ROS_TYPES[type(message)]](header, *ros_content(message))
    return bytes(ROS.serialize_cdr(twin, ROS_TYPES[type(message)]))


@given(messages)
def test_a_message_comes_back_as_it_went(message):
    assert decode(type(message), encode(message)) == message


@pytest.mark.parametrize("of_one_kind", MESSAGES)
@given(data=st.data())
def test_the_bytes_are_those_of_rosbags(of_one_kind, data):
    message = data.draw(of_one_kind)
    assert encode(message) == ros_bytes(message)
    assert decode(type(message), ros_bytes(message)) == message


@pytest.mark.parametrize("length", range(21))
def test_every_frame_id_keeps_the_alignment(length):
    stamp, frame, place = 3 * SECOND + 7, "f" * length, (1.0, 2.0, 3.0)
    several = tuple(Body(BodyKind.OBSTACLE, place, radius) for radius in (0.0, 0.5, 1.0))
    for message in (
        Pose(stamp, frame, place),
        Estimate(stamp, frame, LeaderMotion(place, place, place), stamp - 1, 3, Leading.LEADS),
        Command(stamp, frame, place, 0.5),
        Nearby(stamp, frame, several),
        Telemetry(stamp, frame, FlightState.FLYING, 0.5, 1.0, 0.01),
        Mission(stamp, frame, "start", stamp, "line"),
        Mission(stamp, frame, "formation", stamp, "line", Change(stamp, 2.0, "", (0, 1, 2), (2, 0, 1))),
        Mission(stamp, frame, "start", giver=7, number=9, downs=((stamp - 1, 8), (stamp, 2**31))),
        Stop(stamp, frame, "why"),
        TimeRequest(stamp, frame),
        TimeReply(stamp, frame, stamp - 1, stamp + 1),
        Status(stamp, frame, "uav1", Report("hold"), 1, 2, 3, 4, 5, 0.5, 6, (("a", 1),), ("gateway",)),
        Status(
            stamp,
            frame,
            "driver1",
            Report("grounded", reasons=REASONS, place=17, code="own pose: refuse"),
            1,
            2,
            3,
            4,
            5,
            0.5,
            6,
            (),
            (),
        ),
        Status(
            stamp,
            frame,
            "uav1",
            Report("hold", mission=Mission(stamp - 2, frame, "start", stamp, "line"), unnumbered=((stamp, 1),)),
            1,
            2,
            3,
            4,
            5,
            0.5,
            6,
            (("a", 1),),
            ("gateway",),
        ),
    ):
        assert encode(message) == ros_bytes(message)
        assert decode(type(message), encode(message)) == message


def test_an_origin_of_more_than_a_second_of_nanoseconds_is_rejected():
    message = Estimate(SECOND, "world", LeaderMotion((0.0,) * 3), origin=7 * SECOND + 999_999_999)
    data = bytearray(encode(message))
    place = data.index((999_999_999).to_bytes(4, "little"))
    data[place : place + 4] = SECOND.to_bytes(4, "little")
    with pytest.raises(MessageError, match="more than a second"):
        decode(Estimate, bytes(data))


def test_a_status_without_an_order_names_none():
    status = Status(SECOND, "world", "uav1", Report("ready"), 1, 2, 3, 4, 5, 0.5, 6, (), ())
    assert decode(Status, encode(status)).report.mission is None


@given(st.lists(bodies, max_size=40).map(tuple))
def test_any_number_of_nearby_bodies_comes_back(many):
    message = Nearby(SECOND, "world", many)
    assert decode(Nearby, encode(message)) == message


@given(messages, st.integers(0, 3))
def test_padding_to_a_multiple_of_four_is_harmless(message, padding):
    assert decode(type(message), encode(message) + bytes(padding)) == message


@pytest.mark.parametrize("message", dict.fromkeys(row.message for row in TABLE), ids=lambda m: m.__name__)
def test_the_schema_in_the_trace_says_all_that_rosbags_needs(message):
    alone = get_typestore(Stores.EMPTY)
    alone.register(get_types_from_msg(schema_text(ROS_TYPES[message]), ROS_TYPES[message]))
    assert alone.types.keys() >= {ROS_TYPES[message], "std_msgs/msg/Header"}
