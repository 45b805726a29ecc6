"""A viewer that shares no code with flockwire: a client of Foxglove's protocol, and a decoder of ROS 2 messages."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any, NamedTuple

from mcap.records import Schema
from mcap_ros2.decoder import DecoderFactory
from robo_ws_bridge import WebSocketBridgeClient

LOOK = 0.05  # s between two looks whether what is waited for is there


class Seen(NamedTuple):
    """One message of a topic: the time that came with it (Unix ns) and its bytes."""

    topic: str
    time: int
    data: bytes


class Viewer:
    """Subscribes to every channel that is advertised; decodes its messages by the schema that came with it."""

    def __init__(self, url: str) -> None:
        self.topics: set[str] = set()
        self.seen: list[Seen] = []
        self.capabilities: list[str] | None = None  # what the server lets its clients do but look
        self._decoders: dict[str, Callable[[bytes], Any]] = {}
        self._news = asyncio.Event()
        self.client = WebSocketBridgeClient(url, subprotocol="foxglove.sdk.v1")
        self.client.on_server_info(self._greeted)
        self.client.on_advertised_channel(self._advertised)
        self.client.on_message(self._received)

    async def until(self, met: Callable[[], bool], seconds: float = 10.0) -> None:
        """Return as soon as it is so; `met` is asked at each message and every LOOK s."""
        async with asyncio.timeout(seconds):
            while not met():
                self._news.clear()
                with contextlib.suppress(TimeoutError):
                    async with asyncio.timeout(LOOK):
                        await self._news.wait()

    def decoded(self, seen: Seen) -> Any:
        """Return the content of a message."""
        return self._decoders[seen.topic](seen.data)

    def _greeted(self, _: str, capabilities: list[str], __: str | None) -> None:
        self.capabilities = capabilities

    async def _advertised(self, channel: Any) -> None:
        schema = Schema(
            id=1, name=channel["schemaName"], encoding=channel["schemaEncoding"], data=channel["schema"].encode()
        )
        decoder = DecoderFactory().decoder_for(channel["encoding"], schema)
        assert decoder is not None
        self._decoders[channel["topic"]] = decoder
        self.topics.add(channel["topic"])
        await self.client.subscribe(channel["topic"])

    def _received(self, channel: Any, time: int, data: bytes) -> None:
        self.seen.append(Seen(channel["topic"], time, bytes(data)))
        self._news.set()


@asynccontextmanager
async def viewing(url: str) -> AsyncIterator[Viewer]:
    """Connect a viewer for as long as the context lasts."""
    viewer = Viewer(url)
    await viewer.client.connect()
    try:
        yield viewer
    finally:
        await viewer.client.disconnect()
