"""The gateway's node in the ROS graph, which receives the poses."""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections import Counter
from collections.abc import Callable
from functools import partial

from flockwire_core import clock
from flockwire_core.ros.graph import advice, dds_type
from flockwire_core.runtime.ros_ends import RosInput
from flockwire_core.runtime.ros_node import Place, RosNode, join
from flockwire_core.wire.processes import GATEWAY

from flockwire_mocap.ros.source import RosSource


class RosClient(contextlib.AbstractAsyncContextManager[None]):
    """Receives the topics of `source`; calls `drained` after each message."""

    def __init__(self, source: RosSource, drained: Callable[[], None]) -> None:
        self._source, self._drained = source, drained
        self._ended = asyncio.Event()
        self._task: asyncio.Task[None]
        self._shown: set[str] = set()  # topics to which others see a subscription

    async def __aenter__(self) -> None:
        self._task = asyncio.get_running_loop().create_task(self._run())
        self._task.add_done_callback(self._over)

    async def __aexit__(self, *_: object) -> None:
        self._ended.set()
        await asyncio.wait((self._task,))

    def _over(self, task: asyncio.Task[None]) -> None:
        if not task.cancelled() and (error := task.exception()) is not None:
            self._source.failure = f"the connection to ROS failed: {error!r}"
            logging.getLogger(GATEWAY.kind).error(self._source.failure, exc_info=error)

    async def _run(self) -> None:
        source, table = self._source, self._source.table
        place = Place(table.router, False, table.domain, source.namespace, GATEWAY.kind)
        node = await join(place, self._ended, self._absent)
        if node is None:
            return
        with node:
            for ros_type in source.ros_types:
                waiting: list[RosInput] = []
                wake = partial(self._arrived, ros_type, waiting)
                waiting.append(node.subscribe(source.topic, ros_type, shown=False, wake=wake))
            node.watch()
            seen: Counter[str] = Counter()
            while not self._ended.is_set():
                self._look(node, seen)
                with contextlib.suppress(TimeoutError):
                    await asyncio.wait_for(self._ended.wait(), 1.0)  # s between two looks at the graph

    def _arrived(self, ros_type: str, inputs: list[RosInput]) -> None:
        if self._ended.is_set():
            return
        for arrived in inputs[0].take():
            self._source.message(arrived.topic, ros_type, arrived.payload, clock.now(), arrived.origin.publisher)
            self._drained()

    def _absent(self, why: str) -> None:
        router = self._source.table.router
        self._source.failure = f"gateway.ros.router = {router!r}: no router answers; start rmw_zenohd there ({why})"

    def _look(self, node: RosNode, seen: Counter[str]) -> None:
        """Tell the source whether the router is there, what was dropped, who publishes, and why no pose arrives.

        Others are shown the subscriptions to topics that have a publisher.
        """
        source = self._source
        if node.linked:
            source.failure = ""
        else:
            self._absent("the link is lost")
        source.counts.update(node.counts - seen)
        seen.update(node.counts - seen)
        source.publishers, domain = node.publishers(), source.table.domain
        source.advice = advice(source.publishers, domain, source.topic, source.ros_types, "gateway.ros.domain to that")
        types, hidden = {dds_type(ros_type): ros_type for ros_type in source.ros_types}, set(source.shown) - self._shown
        for end in source.publishers:
            if end.domain == domain and end.dds_type in types and end.name in hidden:
                hidden.discard(end.name)
                self._shown.add(end.name)  # of the type that it has: a topic with two confuses the tools of others
                node.show(end.name, types[end.dds_type])
