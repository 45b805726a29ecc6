"""Programs that share no code with flockwire read a flight's trace: rosbags and mcap-ros2-support, every message."""

from collections import Counter
from dataclasses import is_dataclass

import numpy as np
import pytest
from flockwire_core.domain.body import BodyKind
from flockwire_core.domain.time import SECOND
from flockwire_core.wire.keys import BATCH, ROWS
from flockwire_lab.faults.file import parse_faults
from flockwire_lab.flight import TraceFile
from flockwire_lab.operator import ScriptedSteering
from flockwire_lab.world import EPOCH, World
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader

CHANGES = {  # what it takes for every kind of key to be there
    "control": {"law": "extended", "rate_hz": 50},
    "formation.assignment": "auction",
    "graph": {"edges": [[0, 1], [1, 2], [2, 3], [3, 4], [2, 1], [3, 2], [4, 3]]},
    "leader": {"kind": "teleoperated", "speed": 0.4},
    "hosts": {"ground": {"address": "127.0.0.1"}, "air": {"address": "127.0.0.2", "processes": ["leader"]}},
    "drones.1.host": "air",
    "obstacles": [{"center": [-3.6, 0.9, 0.0], "radius": 0.3}],
    "tracked_obstacles": [{"body": "cart", "radius": 0.2}],
}
VISITOR = {"at": 2.0, "kind": "visitor", "duration": 4.0}
FAULTS = (
    {**VISITOR, "body": "Ada", "start": [-5.0, 0.0, 1.2], "velocity": [1.0, 0.0, 0.0]},
    {**VISITOR, "body": "cart", "start": [3.5, 0.5, 1.2], "velocity": [0.0, 0.0, 0.0]},
)


@pytest.fixture(scope="module")
def flight(make_plan, tmp_path_factory):
    """Return the trace of a virtual flight with every kind of message, and how many each topic had."""
    plan, path = make_plan(CHANGES), tmp_path_factory.mktemp("outside") / "trace.mcap"
    faults, published = parse_faults({"faults": list(FAULTS)}, plan, "test"), Counter()
    trace = TraceFile(path, plan.swarm, "", 0, faults)

    def tap(message):
        published[message.topic] += 1
        trace.take(message)

    world = World(plan.swarm, 0, 20.0, faults, tap)
    world.seat("teleop", ScriptedSteering(world.swarm, lambda _: (0.2, 0.0, 0.0)))
    world.scheduler.at(EPOCH + 8 * SECOND, lambda _: world.stop("enough"))
    world.scheduler.run(EPOCH + 9 * SECOND)
    trace.close()
    return path, published


def plain(value):
    """Return a message of either library as dictionaries, lists and numbers, without rosbags' constants."""
    if is_dataclass(value):
        return {name: plain(content) for name, content in vars(value).items() if name[0].islower()}
    if hasattr(value, "__slots__"):
        return {name: plain(getattr(value, name)) for name in value.__slots__}
    if isinstance(value, np.ndarray):
        return value.tolist()
    return [plain(each) for each in value] if isinstance(value, list) else value


def test_the_flight_has_every_kind_of_message(flight):
    _, published = flight
    of_other_laws = {"signals", "seen", "leads"}
    assert {topic.rpartition("/")[2] for topic in published} == set(ROWS) - {BATCH, *of_other_laws}


def test_rosbags_decodes_every_message_and_encodes_it_as_it_was(flight):
    path, published = flight
    read = Counter()
    with AnyReader([path]) as reader:
        for connection, _, data in reader.messages():
            message = reader.deserialize(data, connection.msgtype)
            assert bytes(reader.typestore.serialize_cdr(message, connection.msgtype)) == data
            read[connection.topic] += 1
    assert read == published


def test_mcap_ros2_decodes_every_message_to_the_same_content(flight):
    path, published = flight
    read = Counter()
    with AnyReader([path]) as rosbags, path.open("rb") as stream:
        types = {connection.topic: connection.msgtype for connection in rosbags.connections}
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        for _, channel, message, decoded in reader.iter_decoded_messages():
            assert plain(decoded) == plain(rosbags.deserialize(message.data, types[channel.topic]))
            read[channel.topic] += 1
    assert read == published


def test_what_the_newer_kinds_say_is_there_for_outsiders(flight):
    path, _ = flight
    with path.open("rb") as stream:
        rows = list(make_reader(stream, decoder_factories=[DecoderFactory()]).iter_decoded_messages())
    content = [(channel.topic.split("/")[2:], message) for _, channel, _, message in rows]
    of = {kind: [(topic[0], message) for topic, message in content if topic[-1] == kind] for kind in ROWS}
    bodies = {(body.kind, body.radius) for _, message in of["nearby"] for body in message.bodies}
    assert bodies >= {(BodyKind.MOVER, 0.4), (BodyKind.MOVER, 0.2), (BodyKind.OBSTACLE, 0.3)}
    assert {message.twist.linear.x for _, message in of["steering"]} == {0.2}
    assert {message.reason for _, message in of["stop"]} == {"enough"}
    asked = {(owner, message.header.stamp.sec, message.header.stamp.nanosec) for owner, message in of["time_request"]}
    answered = {(owner, message.requested.sec, message.requested.nanosec) for owner, message in of["time_reply"]}
    assert answered
    assert answered <= asked
