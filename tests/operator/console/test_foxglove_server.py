"""What `flockwire console --foxglove` serves, read by a client of Foxglove's protocol that shares no code with it."""

import asyncio
import re
import socket
import sys
from contextlib import closing

import pytest
from buffered_session import T0, BufferedSession
from flockwire_core.domain.airframe import FlightState, Telemetry
from flockwire_core.domain.order import Mission
from flockwire_core.domain.time import TimeReply
from flockwire_core.extras import remedy
from flockwire_core.swarm.wording import InputError
from flockwire_core.wire.codec import encode
from flockwire_core.wire.inbox import CANARY
from flockwire_core.wire.keys import Key
from flockwire_core.wire.status import Report, Status
from flockwire_operator.console.command import FoxgloveServer
from foxglove_viewer import viewing

LOOPBACK = "127.0.0.1"
TWO_HOSTS = {
    "hosts": {"ground": {"address": LOOPBACK}, "air": {"address": "127.0.0.2"}},
    "drones.1.host": "air",
}


def message(key):
    """Return what may come on a key."""
    mission = Mission(T0 - 2, "world", "start", T0 + 5, "row", without=(3,))
    report = Report("formation", "why", 0.1, position=(1.0, 2.0, 3.0), mission=mission, counts=(("swaps", 2),))
    return {
        "telemetry": Telemetry(T0, "world", FlightState.FLYING, 0.75, 1.25, 0.01),
        "time_reply": TimeReply(T0, "world", T0 - 1, T0 + 1),
        "status": Status(T0, "world", key.owner, report, 1, 2, 3, 4, 5, 0.5, 6, (("a", 7),), ("gateway", "uav1")),
    }[key.kind]


def session_of(plan):
    """Return what stands for the console's session."""
    session = BufferedSession()
    session.plan, session.identity = plan, "console"
    return session


@pytest.fixture
def serving(make_plan):
    session = session_of(make_plan(TWO_HOSTS))
    with closing(FoxgloveServer(session, LOOPBACK, 0)) as server:
        yield session.plan, session, server


def test_a_viewer_decodes_every_topic_that_the_operator_may_receive_and_sees_no_other(serving):
    plan, session, server = serving
    keys = plan.subscribes["console"]
    topics = {f"/{plan.text(key)}": key for key in keys}

    async def look():
        async with viewing(f"ws://{LOOPBACK}:{server.port}") as viewer:
            await viewer.until(lambda: viewer.topics == set(topics))

            def all_seen():
                for sequence, key in enumerate(keys):
                    session.put(key, encode(message(key)), sequence)
                server.forward(T0)
                return {seen.topic for seen in viewer.seen} == set(topics)

            await viewer.until(all_seen)
            return viewer

    viewer = asyncio.run(look())
    assert viewer.capabilities == []  # it can give no orders
    assert {key.kind for key in topics.values()} == {"telemetry", "status", "time_reply"}
    for seen in viewer.seen:
        key, decoded = topics[seen.topic], viewer.decoded(seen)
        assert (seen.time, seen.data) == (T0, encode(message(key)))
        assert (decoded.header.stamp.sec, decoded.header.frame_id) == (T0 // 10**9, "world")
        if key.kind == "status":
            assert (decoded.identity, decoded.phase, decoded.position.y) == (key.owner, "formation", 2.0)
            assert (decoded.order_without, decoded.links, decoded.counts) == ([3], ["gateway", "uav1"], [2])
        elif key.kind == "telemetry":
            assert (decoded.state, decoded.battery, decoded.height) == (1, 0.75, 1.25)
        else:
            assert (decoded.requested.nanosec, decoded.received.nanosec) == (999_999_999, 1)


def test_what_is_no_message_of_the_swarm_is_not_passed_on(serving):
    plan, session, server = serving
    key = Key("telemetry", "uav1")
    topic = f"/{plan.text(key)}"
    good = encode(message(key))

    async def look():
        async with viewing(f"ws://{LOOPBACK}:{server.port}") as viewer:
            await viewer.until(lambda: topic in viewer.topics)

            def passed():
                for payload in (CANARY, bytes(5000), good):
                    session.put(key, payload, 1)
                server.forward(T0)
                return len(viewer.seen) > 2

            await viewer.until(passed)
            return viewer.seen

    assert {seen.data for seen in asyncio.run(look())} == {good}


def test_a_port_in_use_is_named(make_plan):
    with socket.socket() as taken:
        taken.bind((LOOPBACK, 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(
            InputError, match=rf"^--foxglove = {port}: cannot listen at {LOOPBACK}:{port}: Failed to bind.*in use"
        ):
            FoxgloveServer(session_of(make_plan()), LOOPBACK, port)


def test_a_missing_package_is_named_with_the_command_that_installs_it(make_plan, monkeypatch):
    monkeypatch.setitem(sys.modules, "foxglove", None)
    with pytest.raises(InputError, match=r"^--foxglove = 8765: .*foxglove-sdk: " + re.escape(remedy("foxglove"))):
        FoxgloveServer(session_of(make_plan()), LOOPBACK, 8765)
