"""Topics of ROS 2 as a source of the gateway: a PoseStamped for each body, or a PoseArray of all."""

from __future__ import annotations

import re

from flockwire.domain.pose import Pose
from flockwire.domain.time import nanoseconds
from flockwire.process.cores import Start
from flockwire.ros.definitions import POSE, POSES
from flockwire.ros.messages import read_poses
from flockwire.wire.cdr import MessageError
from flockwire.wire.codec import decode

from flockwire_mocap.streamed import StreamedSource
from flockwire_mocap.tracking import ReportedBody, TrackerFrame, is_pose, unseen

MOST_BODIES = 256  # named by topics
_NAME = r"(\w{1,255})"  # a part of a topic in ROS


class RosSource(StreamedSource):
    """The bodies whose poses the topics report; `message` takes them in. `advice` is why no pose arrives."""

    def __init__(self, start: Start) -> None:
        swarm = start.plan.swarm
        self.table = table = swarm.gateway.ros
        self.namespace = f"/{swarm.name}"
        self.topic, self.ros_type = table.topic.replace("{body}", "*"), POSE
        if table.array is not None:
            self.topic, self.ros_type = table.array, POSES
        self.bodies = table.bodies or tuple(str(swarm.body(i)) for i in swarm.tracked)
        self.advice = ""
        self._body = re.compile(re.escape(table.topic).replace(r"\{body\}", _NAME))
        self._numbers = {body: number for number, body in enumerate(self.bodies)}
        self._stamps: dict[str, int] = {}  # the newest of each topic
        self._number = 0
        awaited = None if table.array is not None else {swarm.body(i): i for i in swarm.tracked}
        waits = f"waits for the router at {table.router}"
        super().__init__(swarm.gateway, waits, table.latency, awaited)

    def trouble(self, now: int) -> str:
        """Return why there is no ROS side, or why no pose arrives from it; empty while they arrive."""
        return self.failure or self.advice

    @property
    def shown(self) -> tuple[str, ...]:
        """The absolute names of the topics of all known bodies."""
        if self.table.array is not None:
            return (self.table.array,)
        return tuple(self.table.topic.replace("{body}", body) for body in self.bodies)

    def message(self, topic: str, payload: bytes, now: int) -> None:
        """Take in a message of `topic` that arrived at `now` (Unix ns); a bad one is counted."""
        try:
            stamp, bodies = self._array(payload) if self.ros_type == POSES else self._pose(topic, payload)
        except MessageError:
            self.counts["poses malformed"] += 1
            return
        if not bodies:
            return
        if stamp <= self._stamps.get(topic, 0):
            set_back = stamp > 0 and self._stamps[topic] - stamp > nanoseconds(1.0)
            self.counts["poses of a clock set back" if set_back else "poses repeated, late or without a stamp"] += 1
            if not set_back:
                return
        self._stamps[topic] = stamp
        self._number += 1
        self.arrived(TrackerFrame(self._number, stamp, stamp, bodies), now)

    def _pose(self, topic: str, payload: bytes) -> tuple[int, tuple[ReportedBody, ...]]:
        found = self._body.fullmatch(topic)
        if found is None:
            self.counts["poses of a name that ROS does not have"] += 1
            return 0, ()
        number = self._numbered(found[1])
        if number is None:
            self.counts["poses of too many bodies"] += 1
            return 0, ()
        pose = decode(Pose, payload)
        if not is_pose(pose.position, pose.orientation):
            self.counts["poses rejected"] += 1
            return 0, ()
        return pose.stamp, (ReportedBody(number, found[1], pose.position, pose.orientation, tracked=True),)

    def _array(self, payload: bytes) -> tuple[int, tuple[ReportedBody, ...]]:
        stamp, poses = read_poses(payload)
        if len(poses) != len(self.bodies):
            self.counts["arrays of another length"] += 1
            wanted = f"{len(self.bodies)} bodies are expected"
            self.advice = f"{self.topic} has {len(poses)} poses, but {wanted}: set gateway.ros.bodies"
            return 0, ()
        return stamp, tuple(
            ReportedBody(number, body, *pose, tracked=True) if is_pose(*pose) else unseen(number, body)
            for number, (body, pose) in enumerate(zip(self.bodies, poses, strict=True))
        )

    def _numbered(self, body: str) -> int | None:
        """Return the number of a body, None for one too many."""
        if body not in self._numbers and len(self._numbers) < MOST_BODIES:
            self._numbers[body] = len(self._numbers)
        return self._numbers.get(body)
