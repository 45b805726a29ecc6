"""A motion capture driver of ROS 2 as a tracker's twin: it publishes the poses of all bodies."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Iterable

from flockwire_core.domain.pose import Pose
from flockwire_core.ros.messages import POSE, POSES, pose_array
from flockwire_core.runtime.ros_ends import RosOutput
from flockwire_core.runtime.ros_node import Place, RosNode, join
from flockwire_core.swarm.gateway import RosPoses
from flockwire_core.wire.codec import encode
from flockwire_core.wire.processes import TRACKER
from flockwire_mocap.tracking import TrackerFrame

FRAME = "tracker"
NO_ROUTER = "gateway.ros.router = {router!r}: no router answers, nothing is published; start rmw_zenohd there ({why})"
NOT_SEEN = (float("nan"),) * 3, (0.0, 0.0, 0.0, 1.0)


class RosServer:
    """Publishes the poses of the bodies `names` on the topics of `table`, as soon as its router answers."""

    def __init__(self, names: Iterable[str], table: RosPoses) -> None:
        self._names, self._table = table.bodies or tuple(names), table
        self._ended = asyncio.Event()
        self._node: RosNode | None = None
        self._outputs: dict[str, RosOutput] = {}
        self._array: RosOutput | None = None
        self._task: asyncio.Task[None] | None = None

    async def open(self) -> None:
        """Start to connect."""
        self._task = asyncio.get_running_loop().create_task(self._join())

    def close(self) -> None:
        """Publish nothing any more."""
        self._ended.set()
        self._outputs, self._array = {}, None
        if self._node is not None:
            self._node.close()

    def publish(self, frame: TrackerFrame) -> None:
        """Publish the poses of a frame; a body that is not tracked has none, in an array NaN."""
        seen = {body.name or "": (body.position, body.orientation) for body in frame.bodies if body.tracked}
        if self._array is not None:
            poses = [seen.get(name, NOT_SEEN) for name in self._names]
            self._array.publish(pose_array(frame.captured, FRAME, poses))
        for name, pose in seen.items():
            output = self._outputs.get(name)
            if output is not None:
                output.publish(encode(Pose(frame.captured, FRAME, *pose)))

    def _absent(self, why: str) -> None:
        logging.getLogger(TRACKER.kind).warning(NO_ROUTER.format(router=self._table.router, why=why))

    async def _join(self) -> None:
        place = Place(self._table.router, False, self._table.domain, "/", TRACKER.kind.replace("-", "_"))
        node = await join(place, self._ended, self._absent)
        if node is None:
            return
        if self._ended.is_set():
            node.close()
            return
        self._node = node
        if self._table.array is not None:
            self._array = node.publisher(self._table.array, POSES)
        else:
            topics = {name: self._table.topic.replace("{body}", name) for name in self._names}
            self._outputs = {name: node.publisher(topic, POSE) for name, topic in topics.items()}
