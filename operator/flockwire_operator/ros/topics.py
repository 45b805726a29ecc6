"""The table of all topics that the swarm has in ROS 2."""

from __future__ import annotations

from typing import NamedTuple

from flockwire_core.ros import messages
from flockwire_core.ros.graph import DEFAULT, LATCHED, Qos
from flockwire_core.swarm.model import Swarm, uav
from flockwire_core.swarm.ros import Ros, namespace_of
from flockwire_core.wire.information import accelerates
from flockwire_core.wire.keys import Key
from flockwire_core.wire.plan import Plan

DEEP = Qos(depth=100)  # transforms, as tf2 publishes them


class Topic(NamedTuple):
    """One topic: its absolute name, the type of its messages and their quality of service."""

    name: str
    ros_type: str
    qos: Qos = DEFAULT


TF = Topic("/tf", messages.TRANSFORMS, DEEP)
TF_STATIC = Topic("/tf_static", messages.TRANSFORMS, LATCHED)
DIAGNOSTIC_ARRAY = Topic("/diagnostics", messages.DIAGNOSTICS)
MARKER_ARRAY = Topic("/swarm/markers", messages.MARKERS)
SWARM_STATUS = Topic("/swarm/status", messages.DIAGNOSTIC, LATCHED)
SIM_CLOCK = Topic("/clock", messages.CLOCK, Qos(reliable=False, depth=1))
SHARED = (TF, TF_STATIC, DIAGNOSTIC_ARRAY, MARKER_ARRAY, SWARM_STATUS)
CMD_ACCEL = "cmd_accel"  # of drones that are commanded accelerations
OF_KEYS = {  # by the kind of key: topics of its owner
    "pose": (("pose", messages.POSE), ("odom", messages.ODOMETRY)),
    "command": (("cmd_vel", messages.TWIST), (CMD_ACCEL, messages.ACCELERATION)),
    "estimate": (("leader_estimate", messages.ODOMETRY),),
    "telemetry": (("battery", messages.BATTERY),),
}


class Names:
    """The names of a swarm in ROS 2: its namespace, its frames."""

    def __init__(self, swarm: Swarm) -> None:
        table = swarm.ros if swarm.ros is not None else Ros()
        self.namespace = namespace_of(swarm.name, table)
        self.world, self._prefix = swarm.frame, table.frame_prefix
        self.accelerated = frozenset(uav(i) for i in swarm.followers if accelerates(swarm, i))

    def absolute(self, name: str) -> str:
        """Return the absolute name of a topic or service of the swarm."""
        return f"{self.namespace.rstrip('/')}/{name}"

    def frame(self, name: str) -> str:
        """Return the name of a frame of the swarm."""
        return f"{self._prefix}{name}"


def topics_of(names: Names, key: Key) -> tuple[Topic, ...]:
    """Return the topics with the content of `key`."""
    found = OF_KEYS.get(key.kind, ())
    return tuple(
        Topic(names.absolute(f"{key.owner}/{last}"), kind)
        for last, kind in found
        if last != CMD_ACCEL or key.owner in names.accelerated
    )


def all_topics(plan: Plan) -> tuple[Topic, ...]:
    """Return all topics of a swarm but the clock's."""
    names = Names(plan.swarm)
    return (*(topic for key in plan.keys for topic in topics_of(names, key)), *SHARED)
