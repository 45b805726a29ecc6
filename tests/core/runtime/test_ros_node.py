"""A node in the ROS graph, on a plain Zenoh router: what comes in is bounded, checked and counted."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator

import pytest
import zenoh
from flockwire_core.ros.graph import LATCHED, data_key
from flockwire_core.ros.messages import POSE, TRIGGER, trigger_response
from flockwire_core.runtime import configuration, ros_node
from flockwire_core.runtime.ros_ends import CAPACITY, LARGEST, MOST_REQUESTS, RosServices
from flockwire_core.runtime.ros_node import Place, RosNode, RosRouterAbsentError, join
from flockwire_core.swarm.gateway import RosPoses
from flockwire_core.wire.inbox import ATTACHMENT
from flockwire_twins.trackers.ros import NO_ROUTER, RosServer
from ports import free_port
from ros_graph import bare, router
from waiting import wait_until

GOOD, EMPTY = ATTACHMENT.pack(3, 4, 16, b"0123456789abcdef"), b"\0\1\0\0\0"
STOP, KEY = "/paper/stop", data_key(0, "/paper/stop", TRIGGER)


@pytest.fixture(scope="module")
def port() -> Iterator[int]:
    found = free_port()
    with router(found):
        yield found


@pytest.fixture
def node(port: int) -> Iterator[RosNode]:
    with RosNode(Place(f"127.0.0.1:{port}", False, 0, "/paper", "ros")) as found:
        yield found


@pytest.fixture
def attacker(port: int) -> Iterator[zenoh.Session]:
    with bare(port) as found:
        yield found


def asked(session: zenoh.Session, services: RosServices, key: str, **request: object) -> list[zenoh.Reply]:
    """Return the replies to a query, after the node has answered every request that it took."""
    replies = session.get(key, timeout=5.0, **request)
    found: list[zenoh.Reply] = []

    def over() -> bool:
        for one in services.take():
            one.answer(True, f"{one.name} done")
        try:
            while (reply := replies.try_recv()) is not None:
                found.append(reply)
        except zenoh.ZError:  # all have replied
            return True
        return False

    wait_until(over)
    return found


def served(node: RosNode, session: zenoh.Session) -> RosServices:
    """Return the services of `node` when the router knows them."""
    services = node.serve((STOP, "/paper/land"))
    wait_until(lambda: bool(asked(session, services, KEY, payload=EMPTY, attachment=GOOD)))
    return services


def test_a_request_is_answered_with_its_own_number_and_sender(node: RosNode, attacker: zenoh.Session) -> None:
    services = served(node, attacker)
    (reply,) = asked(attacker, services, KEY, payload=EMPTY, attachment=GOOD)
    assert reply.ok.payload.to_bytes() == trigger_response(True, "/paper/stop done")
    sequence, _, size, sender = ATTACHMENT.unpack(reply.ok.attachment.to_bytes())
    assert (sequence, size, sender) == (3, 16, b"0123456789abcdef")
    assert not node.counts


@pytest.mark.parametrize(
    ("key", "payload", "attachment", "reason"),
    [
        (KEY, None, None, "ROS requests malformed"),
        (KEY, EMPTY, None, "ROS requests malformed"),
        (KEY, EMPTY, GOOD[:-1], "ROS requests malformed"),
        (KEY, b"\0\1\0\0\1", GOOD, "ROS requests malformed"),
        (KEY, bytes(LARGEST + 1), GOOD, "ROS requests too large"),
        (KEY, EMPTY, GOOD + bytes(1), "ROS requests malformed"),
        (KEY, EMPTY, bytes(LARGEST + 1), "ROS requests too large"),
        ("0/paper/**", EMPTY, GOOD, "ROS requests of several services"),
        ("**", EMPTY, GOOD, "ROS requests of several services"),
        (KEY.replace("stop", "*"), EMPTY, GOOD, "ROS requests of several services"),
    ],
)
def test_what_is_no_request_of_one_service_is_refused_and_counted(
    node: RosNode, attacker: zenoh.Session, key: str, payload: bytes | None, attachment: bytes | None, reason: str
) -> None:
    services = served(node, attacker)
    for reply in asked(attacker, services, key, payload=payload, attachment=attachment):
        assert reply.ok is None or "done" not in str(reply.ok.payload.to_bytes())
    assert set(node.counts) == {reason}


def test_requests_beyond_what_may_wait_are_refused_at_once(node: RosNode, attacker: zenoh.Session) -> None:
    services = served(node, attacker)
    for _ in range(MOST_REQUESTS + 20):
        attacker.get(KEY, payload=EMPTY, attachment=GOOD, timeout=5.0)
    wait_until(lambda: node.counts["ROS requests too many"] == 20)
    attacker.get(KEY.replace("stop", "land"), payload=EMPTY, attachment=GOOD, timeout=5.0)
    found = [one.name for one in services.take()]
    found += wait_until(lambda: [one.name for one in services.take()]) if "/paper/land" not in found else []
    assert found == [STOP] * MOST_REQUESTS + ["/paper/land"]


def test_messages_are_bounded_checked_and_counted(node: RosNode, attacker: zenoh.Session) -> None:
    async def flood() -> tuple[int, set[bytes]]:
        key = data_key(0, "/mocap/a/pose", POSE)
        source = node.subscribe("/mocap/*/pose", POSE, shown=False)
        await asyncio.sleep(0)
        wait_until(lambda: _arrives(attacker, key, source.take))
        attacker.put(key, bytes(LARGEST + 1), attachment=GOOD)
        attacker.put(key, b"x" * 40)
        attacker.put(key, b"x" * 40, attachment=b"short")
        for _ in range(CAPACITY + 10):
            attacker.put(key, b"pose", attachment=GOOD, congestion_control=zenoh.CongestionControl.BLOCK)
        wait_until(lambda: node.counts["ROS messages too many"] >= 12)
        found = source.take()
        return len(found), {one.payload for one in found} | {one.topic.encode() for one in found}

    count, seen = asyncio.run(flood())
    assert count == CAPACITY
    assert seen == {b"pose", b"/mocap/a/pose"}
    assert node.counts["ROS messages too large"] == 1


def _arrives(session: zenoh.Session, key: str, take: Callable[[], list[object]]) -> bool:
    """Return whether a message arrives: the subscription is known to the router."""
    session.put(key, b"first", attachment=GOOD)
    return bool(take())


def test_a_latched_topic_reaches_who_comes_later_and_its_attachment_is_of_33_bytes(node: RosNode, port: int) -> None:
    output = node.publisher("/swarm/status", POSE, LATCHED)
    output.publish(b"one")
    output.publish(b"two")
    seen: list[tuple[bytes, tuple[int, int, int, bytes]]] = []

    def arrived(sample: zenoh.Sample) -> None:
        assert sample.attachment is not None
        seen.append((sample.payload.to_bytes(), ATTACHMENT.unpack(sample.attachment.to_bytes())))

    with bare(port) as late:
        subscriber = zenoh.ext.declare_advanced_subscriber(
            late,
            data_key(0, "/swarm/status", POSE),
            arrived,
            history=zenoh.ext.HistoryConfig(detect_late_publishers=True),
        )
        wait_until(lambda: bool(seen))
        output.publish(b"three")
        wait_until(lambda: len(seen) == 2)
        subscriber.undeclare()
    assert [payload for payload, _ in seen] == [b"two", b"three"]
    assert [told[0] for _, told in seen] == [2, 3]
    assert {told[2] for _, told in seen} == {16}


def test_the_ends_of_other_nodes_are_seen_in_all_domains(node: RosNode, port: int) -> None:
    with RosNode(Place(f"127.0.0.1:{port}", False, 5, "/", "driver")) as other:
        other.publisher("/mocap/a/pose", POSE)
        node.watch()
        wait_until(lambda: bool(node.publishers()))
        (end,) = node.publishers()
        assert (end.domain, end.node, end.name) == (5, "/driver", "/mocap/a/pose")
    wait_until(lambda: not node.publishers())


def test_tokens_of_another_form_and_too_many_are_counted(
    node: RosNode, attacker: zenoh.Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ros_node, "MOST_ENDS", 3)
    tail = "MP/%/%/n/%t/geometry_msgs::msg::dds_::Pose_/RIHS01_0/::,:,:,:,,"
    odd = (
        "x",
        "0/s/0/1/XX/%/%/n",
        f"0/s/0/1/{tail.replace('%t', '%' + 't' * 2000)}",
        f"0/s/0/1/{tail}".replace("/n/", "/\N{SNOWMAN}/"),
    )
    tokens = [attacker.liveliness().declare_token(f"@ros2_lv/{one}") for one in odd]
    tokens += [attacker.liveliness().declare_token(f"@ros2_lv/0/s/0/{k}/{tail}") for k in range(5)]
    node.watch()
    wait_until(lambda: node.counts["ROS tokens not read"] >= 4 and node.counts["ROS tokens too many"] >= 2)
    assert len(node.publishers()) == 3
    for token in tokens:
        token.undeclare()
    wait_until(lambda: not node.publishers())
    assert node.counts == {"ROS tokens not read": 4, "ROS tokens too many": 2}  # nodes' own tokens are none of both


def test_without_a_router_there_is_no_node_and_a_second_router_has_no_place(
    port: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(configuration, "PATIENCE", 50)
    absent = f"127.0.0.1:{free_port()}"
    with pytest.raises(RosRouterAbsentError, match="Unable to connect"):
        RosNode(Place(absent, False, 0, "/", "ros"))
    with pytest.raises(RosRouterAbsentError):
        RosNode(Place(f"127.0.0.1:{port}", True, 0, "/", "ros"))


def test_a_node_joins_when_its_router_comes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ros_node, "PAUSE", 0.05)
    monkeypatch.setattr(configuration, "PATIENCE", 50)
    own = free_port()

    async def late() -> None:
        failed, said = asyncio.Event(), list[str]()

        def absent(why: str) -> None:
            said.append(why)
            failed.set()

        task = asyncio.create_task(join(Place(f"127.0.0.1:{own}", False, 0, "/", "ros"), asyncio.Event(), absent))
        await failed.wait()
        with router(own):
            node = await task
            assert node is not None
            with node:
                assert node.linked
        assert "Unable to connect" in said[0]
        assert len(said) == len(set(said))

    asyncio.run(late())


def test_a_tracker_s_twin_says_that_no_router_answers(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(configuration, "PATIENCE", 50)
    address = f"127.0.0.1:{free_port()}"

    async def alone() -> None:
        server = RosServer(["uav0"], RosPoses(router=address))
        await server.open()
        await asyncio.to_thread(wait_until, lambda: bool(caplog.messages))
        server.close()

    asyncio.run(alone())
    assert caplog.messages[0].startswith(NO_ROUTER.format(router=address, why="Unable to connect").removesuffix(")"))


def test_a_node_that_is_the_router_serves_others() -> None:
    own = free_port()
    with RosNode(Place(f"127.0.0.1:{own}", True, 0, "/", "ros")) as node:
        assert node.linked
        output = node.publisher("/a", POSE)
        seen: list[bytes] = []
        with bare(own) as client:
            client.declare_subscriber(data_key(0, "/a", POSE), lambda sample: seen.append(sample.payload.to_bytes()))
            wait_until(lambda: output.publish(b"x") is None and bool(seen))
