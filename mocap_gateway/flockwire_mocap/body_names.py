"""The names of the bodies in messages of ROS 2: by the topic, by the message, or by their order in it."""

from __future__ import annotations

import re
from collections.abc import Iterable

from flockwire_core.ros.messages import NAMED_POSES, POSE, POSES, TRANSFORM, TRANSFORMS, NamedPose
from flockwire_core.swarm.gateway import BodyTopics
from flockwire_core.swarm.model import Swarm, uav

SINGLE: tuple[str, ...] = (POSE, TRANSFORM)  # types of a topic of one body
OF_ALL: tuple[str, ...] = (POSES, NAMED_POSES, TRANSFORMS)  # types of a topic of all bodies
_PART = r"(\w{1,255})"  # a part of a topic in ROS


class LengthError(ValueError):
    """A PoseArray that has not as many poses as bodies are named."""


class BodyNames:
    """Names the bodies of the topics of `table`; `bodies` are those of a PoseArray, in its order.

    Of transforms only those of the frame in which a body of the swarm file is reported are bodies. Without a topic they
    are those of a trace of this project, whose topics have the drones' numbers.
    """

    def __init__(self, table: BodyTopics, swarm: Swarm) -> None:
        self.bodies = table.bodies or tuple(str(swarm.body(i)) for i in swarm.tracked)
        self.ros_types = SINGLE if table.array is None else OF_ALL
        pattern = re.escape(table.array or table.topic or "").replace(r"\{body\}", _PART, 1).replace(r"\{body\}", r"\1")
        self._own: dict[str, str] = {}  # of such a trace, by the topic's part
        if not pattern:
            self.ros_types = (POSE,)
            self._own = {uav(i): str(swarm.body(i)) for i in swarm.tracked}
            pattern = rf"/\w+/({'|'.join(self._own)})/pose"
        self._topic = re.compile(pattern)
        self._known = frozenset({*self.bodies, *(one.body for one in swarm.tracked_obstacles)})
        self._parents: dict[str, str] = {}  # the frames in which transforms have the known bodies

    def matches(self, topic: str, ros_type: str) -> bool:
        """Return whether messages of this topic and type are read."""
        return ros_type in self.ros_types and self._topic.fullmatch(topic) is not None

    def of(self, topic: str, ros_type: str, found: list[NamedPose]) -> Iterable[tuple[str, NamedPose]]:
        """Return what was `found` in a message, with names; an empty name is not known. Raises LengthError."""
        if ros_type in SINGLE:
            match = self._topic.fullmatch(topic)
            name = match[1] if match else ""
            return [(self._own.get(name, name), one) for one in found]
        if ros_type == POSES:
            if len(found) != len(self.bodies):
                raise LengthError(f"{topic} has {len(found)} poses, but {len(self.bodies)} bodies are expected")
            return zip(self.bodies, found, strict=True)
        return [(one.name, one) for one in (self._bodies_among(found) if ros_type == TRANSFORMS else found)]

    def _bodies_among(self, found: list[NamedPose]) -> list[NamedPose]:
        """Return the transforms whose parents have a known body: others are parts of robots."""
        self._parents |= {one.name: one.frame for one in found if one.name in self._known}
        parents = set(self._parents.values())
        return [one for one in found if one.frame in parents]
