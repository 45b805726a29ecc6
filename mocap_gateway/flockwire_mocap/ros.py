"""Topics of ROS 2 as a source of the gateway: one for each body, or one of all, of any motion capture driver."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import re
from collections import Counter
from collections.abc import Callable
from functools import partial
from typing import NamedTuple

from flockwire_core import clock
from flockwire_core.domain.time import SECOND
from flockwire_core.process.cores import Start
from flockwire_core.ros.graph import End, advice, dds_type
from flockwire_core.ros.messages import NAMED_POSES, POSES, NamedPose, read_poses
from flockwire_core.runtime.ros_ends import RosInput
from flockwire_core.runtime.ros_node import Place, RosNode, join
from flockwire_core.wire.cdr import MessageError
from flockwire_core.wire.processes import GATEWAY

from flockwire_mocap.body_names import OF_ALL, BodyNames, LengthError
from flockwire_mocap.streamed import StreamedSource
from flockwire_mocap.tracking import ReportedBody, TrackerFrame, is_pose, unseen

MOST_BODIES = 256  # that topics and messages may name
OWNED = SECOND  # ns without its publisher's poses after which another publisher may report a body
NO_STAMP = "{}: header.stamp of its poses is {}: set the driver to stamp them with their exposure"
UNSET, SAME = "0", "always the same"
SECOND_PUBLISHER = "poses of a second publisher, {}"
_NAME = re.compile(r"[\w .:-]{1,255}")  # a name that is safe to show


class Report(NamedTuple):
    """The newest report of a body: its sender, its stamp (ns), when it arrived (Unix ns)."""

    sender: str
    stamp: int
    at: int


class RosSource(StreamedSource):
    """The bodies whose poses the topics report; `message` takes them in.

    Each body has one publisher at a time. `publishers` are those of the graph, `advice` is why no message arrives.
    """

    def __init__(self, start: Start) -> None:
        swarm = start.plan.swarm
        self.table = table = swarm.gateway.ros
        self.namespace = f"/{swarm.name}"
        self.topic = table.array or table.topic.replace("{body}", "*")
        self._names = BodyNames(table, swarm)
        self.ros_types, self.bodies = self._names.ros_types, self._names.bodies
        self.advice = ""
        self.publishers: tuple[End, ...] = ()
        self._rejected = ""  # why the newest message was not used; empty if it was
        self._numbers = {body: number for number, body in enumerate(self.bodies)}
        self._reports: dict[str, Report] = {}  # by body
        self._number = 0
        self._used_at = 0
        waits = f"waits for the router at {table.router}"
        super().__init__(swarm.gateway, waits, table.latency, {swarm.body(i): i for i in swarm.tracked})

    def trouble(self, now: int) -> str:
        """Return why there is no ROS side, or why no pose arrives from it; empty while they arrive."""
        return self.failure or ("" if now - self._used_at < SECOND else self._rejected or self.advice)

    @property
    def shown(self) -> tuple[str, ...]:
        """The absolute names of the topics of all known bodies."""
        if self.table.array is not None:
            return (self.table.array,)
        return tuple(self.table.topic.replace("{body}", body) for body in self.bodies)

    def sender_name(self, sender: str) -> str:
        """Return the topic that a sender publishes, with the nodes that do."""
        topic, domain = sender.partition("#")[0], self.table.domain
        nodes = sorted({end.node for end in self.publishers if end.name == topic and end.domain == domain})
        return f"{topic} ({', '.join(nodes)})" if nodes else topic

    def message(self, topic: str, ros_type: str, payload: bytes, now: int, publisher: bytes = b"") -> None:
        """Take in a message of `topic` that arrived at `now` (Unix ns); a bad one is counted.

        `publisher` is the id of who sent it: each has its own clock.
        """
        try:
            named = self._names.of(topic, ros_type, read_poses(ros_type, payload))
        except MessageError:
            self.counts["poses malformed"] += 1
            return
        except LengthError as error:
            self.counts["arrays of another length"] += 1
            self._rejected = f"{error}: set gateway.ros.bodies"
            return
        sender, frames = f"{topic}#{publisher.hex()}", dict[int, list[ReportedBody]]()
        for name, one in named:
            body = self._reported(name, one, sender, now)
            if body is not None:
                frames.setdefault(one.stamp, []).append(body)
        for stamp, bodies in frames.items():
            self._number += 1
            self._used_at, self._rejected = now, ""
            whole = ros_type in (POSES, NAMED_POSES)
            self.arrived(TrackerFrame(self._number, stamp, stamp, tuple(bodies)), now, sender, whole)

    def _reported(self, name: str, one: NamedPose, sender: str, now: int) -> ReportedBody | None:
        """Return a body with its pose, None if its report is not used, which is counted."""
        unused, is_valid = self._unused(name, one, sender), is_pose(one.position, one.orientation)
        if not (unused or is_valid or self.ros_types == OF_ALL):
            unused = "poses rejected"
        if unused:
            self.counts[unused] += 1
            return None
        newest = self._reports.get(name)
        if newest is not None and newest.sender != sender and now - newest.at < OWNED:
            self.count_named(SECOND_PUBLISHER, sender)
            return None
        number = self._numbers.setdefault(name, len(self._numbers))
        self._reports[name] = Report(sender, one.stamp, now)
        if not is_valid:
            return unseen(number, name)
        return ReportedBody(number, name, one.position, one.orientation, tracked=True)

    def _unused(self, name: str, one: NamedPose, sender: str) -> str:
        """Return why a report is not used; empty if it may be, by its name and stamp."""
        newest = self._reports.get(name)
        if not _NAME.fullmatch(name):
            return "poses of a name that ROS does not have"
        if name not in self._numbers and len(self._numbers) >= MOST_BODIES:
            return "poses of too many bodies"
        if one.stamp <= 0:
            self._rejected = NO_STAMP.format(self.sender_name(sender), UNSET)
            return "poses without a stamp"
        if newest is not None and newest.sender == sender and one.stamp <= newest.stamp:
            if newest.stamp - one.stamp <= SECOND:
                self._rejected = NO_STAMP.format(self.sender_name(sender), SAME)  # until it is another
                return "poses repeated or late"
            self.counts["poses of a clock set back"] += 1
        return ""


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
