"""The leader that follows a topic of ROS 2: its velocity, or the way to a place."""

from __future__ import annotations

from collections import Counter

from flockwire_core.control.tracker import VelocityTracker
from flockwire_core.domain.airframe import Steer
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import Vector, add, limit, scale, subtract
from flockwire_core.ros.messages import POSE, TWIST
from flockwire_core.swarm.model import Swarm, uav
from flockwire_core.wire.cdr import MessageError
from flockwire_core.wire.codec import decode
from flockwire_core.wire.keys import STEERING, Key

from flockwire_operator.ros.topics import Topic


class Steering:
    """Turns the newest message of the leader's topic into a steering command; `counts` counts bad ones.

    Of a place x_d (PoseStamped), with the leader at x and its gain k (leader.tracking_gain):

        v = v_d + k (x_d − x)        (ours; v_d is the tracked velocity of x_d, and |v| at most leader.speed)
    """

    def __init__(self, swarm: Swarm, number: int) -> None:
        self.counts: Counter[str] = Counter()
        table = swarm.leading[number].ros
        self.topic = Topic(table.topic, TWIST if table.message == "TwistStamped" else POSE)
        self._frame, self._leader = swarm.frame, swarm.leading[number]
        self._key = Key(STEERING, uav(number))
        self._position: Vector | None = None
        self._place: VelocityTracker | None = None
        self._velocity: Vector | None = None

    def position(self, position: Vector) -> None:
        """Take the leader's position, m, world frame."""
        self._position = position

    def take(self, payload: bytes, now: int) -> None:
        """Take a message of the topic that arrived at `now` (Unix ns)."""
        farthest = 1e6  # m and m/s: larger numbers have no velocity that can be computed
        try:
            message = decode(Steer, payload) if self.topic.ros_type == TWIST else decode(Pose, payload)
        except MessageError:
            self.counts["ROS steering malformed"] += 1
            return
        if message.frame not in ("", self._frame):
            self.counts["ROS steering of another frame"] += 1
            return
        if max(map(abs, message.velocity if isinstance(message, Steer) else message.position)) > farthest:
            self.counts["ROS steering out of range"] += 1
            return
        self._velocity = message.velocity if isinstance(message, Steer) else self._towards(message, now / SECOND)

    def command(self, now: int) -> list[tuple[Key, Steer]]:
        """Return the steering command at `now` (Unix ns), if a message has come since the last call."""
        velocity, self._velocity = self._velocity, None
        if velocity is None:
            return []
        return [(self._key, Steer(now, self._frame, limit(velocity, self._leader.speed)))]

    def _towards(self, pose: Pose, now: float) -> Vector | None:
        time_constant = 0.2  # s, of the velocity of the place to follow
        forget = 1.0  # s without a place after which its velocity begins again
        place = self._place
        if place is None or now - place.stamp > forget:
            place = self._place = VelocityTracker(time_constant, pose.position, now)
        place.update(pose.position, now)
        if self._position is None:
            return None
        return add(place.velocity, scale(subtract(pose.position, self._position), self._leader.tracking_gain))
