"""Topics of ROS 2 as a source of the gateway: one for each body, or one of all."""

from __future__ import annotations

import re
from typing import NamedTuple

from flockwire_core.domain.time import SECOND
from flockwire_core.process.cores import Start
from flockwire_core.ros.graph import End
from flockwire_core.ros.messages import NAMED_POSES, POSES, NamedPose, read_poses
from flockwire_core.wire.cdr import MessageError

from flockwire_mocap.ros.naming import OF_ALL, BodyNames, LengthError
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
