"""Serves the page's messages to Foxglove and Lichtblick: unchanged payloads with their ROS 2 schemas.

foxglove-sdk implements their protocol (foxglove.sdk.v1) in its own threads. Its clients are read-only.
"""

from __future__ import annotations

from collections import Counter

from flockwire_core.extras import remedy
from flockwire_core.runtime.session import Session
from flockwire_core.runtime.topics import Topic, in_order
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.schemas import schema_text


class FoxgloveError(Exception):
    """Foxglove cannot be served: its package is not installed, or its port cannot be opened."""


class FoxgloveServer:
    """Serves at `address` and `port` the topics to which `identity` subscribes on `session`.

    Port 0 means any free port: `port` is the actual one. The constructor raises FoxgloveError.
    """

    def __init__(self, plan: Plan, identity: str, session: Session, address: str, port: int) -> None:
        try:
            import foxglove  # noqa: PLC0415  (an extra)
        except ImportError as error:
            line = f"--foxglove = {port}: needs the package foxglove-sdk: {remedy('foxglove')}"
            raise FoxgloveError(f"{line} ({error})") from None
        self._context = context = foxglove.Context()  # kept, because the channels need it
        try:
            self._server = foxglove.start_server(name=plan.swarm.name, host=address, port=port, context=context)
        except RuntimeError as error:
            reason = str(error).removeprefix("FoxgloveError: ")
            raise FoxgloveError(f"--foxglove = {port}: cannot listen at {address}:{port}: {reason}") from None
        self.port = self._server.port
        self._rejected: Counter[str] = Counter()
        self._topics = [Topic(plan, key, session) for key in plan.subscribes[identity]]
        self._channels = {
            topic.name: foxglove.Channel(
                topic.name,
                schema=foxglove.Schema(
                    name=topic.ros_type, encoding="ros2msg", data=schema_text(topic.ros_type).encode()
                ),
                message_encoding="cdr",
                context=context,
            )
            for topic in self._topics
        }

    def forward(self, now: int) -> None:
        """Pass on the messages received by `now` (Unix ns); call it at least ten times a second."""
        for sent, topic, _, _, payload in in_order(self._topics, now, self._rejected):
            self._channels[topic].log(payload, log_time=max(0, sent))

    def close(self) -> None:
        """Stop serving."""
        self._server.stop()
