"""A ROS graph without ROS: a plain Zenoh router, a node of zenoh-ros2-sdk, and an attacker with a bare session."""

from __future__ import annotations

import contextlib
import json
import os
import struct
from collections import Counter
from collections.abc import Iterator
from typing import Any

import zenoh
from flockwire_core.ros.messages import HASHES, TRIGGER
from rosbags.typesys import Stores, get_typestore

ATTACHMENT = struct.Struct("<qqB16s")
TRIGGER_RESPONSE = "bool success\nstring message"


@contextlib.contextmanager
def router(port: int) -> Iterator[None]:
    """Run a plain Zenoh router, as rmw_zenohd is one."""
    config = {
        "mode": "router",
        "listen": {"endpoints": [f"tcp/127.0.0.1:{port}"]},
        "scouting": {"multicast": {"enabled": False}},
        "open": {"return_conditions": {"connect_scouted": False, "declares": False}},
    }
    session = zenoh.open(zenoh.Config.from_json5(json.dumps(config)))
    try:
        yield
    finally:
        session.close()


@contextlib.contextmanager
def bare(port: int) -> Iterator[zenoh.Session]:
    """Open a session without any rule on the ROS side."""
    config = {
        "mode": "client",
        "connect": {"endpoints": [f"tcp/127.0.0.1:{port}"], "timeout_ms": 5000},
        "scouting": {"multicast": {"enabled": False}},
        "open": {"return_conditions": {"connect_scouted": False, "declares": False}},
    }
    session = zenoh.open(zenoh.Config.from_json5(json.dumps(config)))
    try:
        yield session
    finally:
        session.close()


def definition(ros_type: str) -> str:
    """Return the definition of a type with all that it needs, for the SDK."""
    return get_typestore(Stores.ROS2_JAZZY).generate_msgdef(ros_type, ros_version=2)[0]


class Sdk:
    """A node of zenoh-ros2-sdk: subscribes to topics, decodes every message with rosbags, calls services."""

    def __init__(self, port: int) -> None:
        os.environ["ZENOH_CONFIG_OVERRIDE"] = 'mode="client"'
        from zenoh_ros2_sdk.session import ZenohSession

        ZenohSession._instance = None
        self._session = ZenohSession.get_instance("127.0.0.1", port)
        self._where = {"router_ip": "127.0.0.1", "router_port": port}
        self.counts: Counter[str] = Counter()
        self.last: dict[str, Any] = {}

    def topics(self) -> dict[str, str]:
        """Return the types of all topics of the graph, by name."""
        from zenoh_ros2_sdk.discovery import get_topic_names_and_types

        return {name: types[0] for name, types in get_topic_names_and_types(domain_id=0, **self._where)}

    def services(self) -> dict[str, str]:
        """Return the types of all services of the graph, by name."""
        from zenoh_ros2_sdk.discovery import get_service_names_and_types

        return {name: types[0] for name, types in get_service_names_and_types(domain_id=0, **self._where)}

    def subscribe(self, name: str, ros_type: str, latched: bool = False) -> None:
        """Count the messages of a topic, decoded."""
        from zenoh_ros2_sdk import ROS2Subscriber
        from zenoh_ros2_sdk.qos import QosDurability, QosProfile

        def seen(message: Any) -> None:
            self.counts[name] += 1
            self.last[name] = message

        qos = QosProfile(durability=QosDurability.TRANSIENT_LOCAL) if latched else None
        text, number = definition(ros_type), HASHES[ros_type]
        ROS2Subscriber(name, ros_type, seen, msg_definition=text, type_hash=number, domain_id=0, qos=qos, **self._where)

    def call(self, name: str) -> tuple[bool, str]:
        """Call a std_srvs/Trigger."""
        from zenoh_ros2_sdk import ROS2ServiceClient

        client = ROS2ServiceClient(
            name, TRIGGER, request_definition="", response_definition=TRIGGER_RESPONSE, type_hash=HASHES[TRIGGER],
            domain_id=0, timeout=20.0, **self._where,
        )  # fmt: skip
        found = client.call()
        assert found is not None, name
        return bool(found.success), str(found.message)

    def close(self) -> None:
        """End its session."""
        self._session.session.close()


class Gaps:
    """Counts what was lost of each topic, by the sequence numbers in the attachments.

    Zenoh buffers the samples by itself: a callback in Python would be the slowest reader of all.
    """

    def __init__(self, session: zenoh.Session, keys: list[str]) -> None:
        self.counts: Counter[str] = Counter()
        self.lost: Counter[str] = Counter()
        self.last: dict[str, int] = {}
        self._subscribers = [session.declare_subscriber(key, zenoh.handlers.FifoChannel(100_000)) for key in keys]

    def read(self) -> Gaps:
        """Count what has come."""
        for subscriber in self._subscribers:
            while (sample := subscriber.try_recv()) is not None:
                self._seen(sample)
        return self

    def _seen(self, sample: zenoh.Sample) -> None:
        key = str(sample.key_expr)
        assert sample.attachment is not None
        sequence, _, size, _ = ATTACHMENT.unpack(sample.attachment.to_bytes())
        assert size == 16
        if key in self.last:
            self.lost[key] += sequence - self.last[key] - 1
        self.last[key] = sequence
        self.counts[key] += 1
