"""What the swarm publishes, as messages of ROS 2: pure, messages of the swarm in, publications out."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable
from typing import Any

from flockwire_core.control.tracker import VelocityTracker
from flockwire_core.domain.airframe import Command, Telemetry
from flockwire_core.domain.motion import Estimate
from flockwire_core.domain.pose import LEVEL, Pose, conjugate, rotate
from flockwire_core.domain.time import SECOND
from flockwire_core.process.stepping import is_due, next_deadline
from flockwire_core.ros.messages import NamedPose, battery, derivative, diagnostic, diagnostics, odometry, transforms
from flockwire_core.wire.codec import Message, encode
from flockwire_core.wire.keys import Key
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.status import Status

from flockwire_operator.ros.health import Health
from flockwire_operator.ros.picture import Picture
from flockwire_operator.ros.topics import (
    DIAGNOSTIC_ARRAY,
    MARKER_ARRAY,
    SWARM_STATUS,
    TF,
    TF_STATIC,
    Names,
    Topic,
    topics_of,
)

PICTURE_PERIOD, HEALTH_PERIOD = SECOND // 10, SECOND  # ns
FORGET = SECOND  # ns without a pose after which a velocity begins again
TRACKER_FRAME = "tracker"

PORTION = 49152  # bytes that leave at once: Zenoh's routers drop what exceeds two batches of 64 KiB
OVERHEAD = 128  # bytes of a message besides its payload: key, attachment, time
MOST_WAITING = 8192  # publications; beyond, the oldest are dropped

Publication = tuple[Topic, bytes]


class Mirror:
    """Turns the messages of the swarm of `plan` into those of its topics in ROS 2."""

    def __init__(self, plan: Plan) -> None:
        self._names = names = Names(plan.swarm)
        self._swarm = plan.swarm
        self._statuses: dict[str, Status] = {}
        self._picture, self._health = Picture(plan, self._statuses), Health(plan, self._statuses)
        self._due: list[Publication] = []
        self._moved: list[NamedPose] = []
        self._tracks: dict[str, VelocityTracker] = {}
        self._next_picture = self._next_health = 0
        self._begun = False
        handlers: dict[str, Callable[[Key, tuple[Topic, ...], Any], None]] = {
            "pose": self._pose,
            "command": self._command,
            "estimate": self._estimate,
            "telemetry": self._telemetry,
        }
        self._take = {key: (handlers[key.kind], topics) for key in plan.keys if (topics := topics_of(names, key))}

    def receive(self, key: Key, message: Message) -> None:
        """Take a message of the swarm."""
        found = self._take.get(key)
        if found is not None:
            handler, topics = found
            handler(key, topics, message)
        elif isinstance(message, Status):
            self._statuses[message.identity] = message

    def publications(self, now: int) -> list[Publication]:
        """Return what is to be published at `now` (Unix ns), in order."""
        due, self._due = self._due, []
        if not self._begun:
            self._begun = True
            gateway, name = self._swarm.gateway, self._names.frame(TRACKER_FRAME)
            tracker = NamedPose(now, name, gateway.offset, gateway.rotation)
            due.append((TF_STATIC, transforms(self._names.world, [tracker])))
        if self._moved:
            due.append((TF, transforms(self._names.world, self._moved)))
            self._moved = []
        if is_due(self._next_picture, now, PICTURE_PERIOD):
            self._next_picture = next_deadline(self._next_picture, now, PICTURE_PERIOD)
            due.append((MARKER_ARRAY, self._picture.markers(now)))
        regular = is_due(self._next_health, now, HEALTH_PERIOD)
        if regular:
            self._next_health = next_deadline(self._next_health, now, HEALTH_PERIOD)
        if self._health.changed(now) or regular:
            due.append((DIAGNOSTIC_ARRAY, diagnostics(now, self._health.processes(now))))
            due.append((SWARM_STATUS, diagnostic(self._health.swarm(now))))
        return due

    def _pose(self, key: Key, topics: tuple[Topic, ...], pose: Pose) -> None:
        time_constant = 0.05  # s, of the velocity in an odometry
        stamp, frame, position, orientation = pose.stamp, pose.frame, pose.position, pose.orientation
        name = self._names.frame(key.owner)
        track, seconds = self._tracks.get(key.owner), stamp / SECOND
        if track is None or seconds - track.stamp > FORGET / SECOND:
            track = self._tracks[key.owner] = VelocityTracker(time_constant, position, seconds)
        track.update(position, seconds)
        velocity = rotate(conjugate(orientation), track.velocity)
        self._due.append((topics[0], encode(pose)))
        self._due.append((topics[1], odometry(stamp, frame, name, position, orientation, velocity)))
        self._moved.append(NamedPose(stamp, name, position, orientation))
        self._picture.positions[key.owner] = position

    def _command(self, key: Key, topics: tuple[Topic, ...], command: Command) -> None:
        stamp, frame, turning = command.stamp, command.frame, (0.0, 0.0, command.yaw_rate)
        self._due.append((topics[0], derivative(stamp, frame, command.velocity, turning)))
        self._due += [(topic, derivative(stamp, frame, command.acceleration)) for topic in topics[1:]]

    def _estimate(self, key: Key, topics: tuple[Topic, ...], estimate: Estimate) -> None:
        name, motion = self._names.frame(f"{key.owner}/leader_estimate"), estimate.motion
        told = odometry(estimate.stamp, estimate.frame, name, motion.position, LEVEL, motion.velocity)
        self._due.append((topics[0], told))
        self._picture.estimates[key.owner] = motion.position

    def _telemetry(self, key: Key, topics: tuple[Topic, ...], telemetry: Telemetry) -> None:
        told = battery(telemetry.stamp, self._names.frame(key.owner), telemetry.battery)
        self._due.append((topics[0], told))


class Outgoing:
    """A bounded queue of publications; `dropped` counts those that were too many.

    After a pause of the process they leave in portions, which every router's queue takes.
    """

    def __init__(self) -> None:
        self.dropped = 0
        self._waiting: deque[Publication] = deque()

    def add(self, publications: Iterable[Publication]) -> None:
        """Append publications; drop the oldest of too many."""
        self._waiting.extend(publications)
        while len(self._waiting) > MOST_WAITING:
            self._waiting.popleft()
            self.dropped += 1

    def take(self) -> list[Publication]:
        """Return the next portion, the oldest first."""
        found, size = list[Publication](), 0
        while self._waiting and size < PORTION:
            publication = self._waiting.popleft()
            size += len(publication[1]) + OVERHEAD
            found.append(publication)
        return found

    def __len__(self) -> int:
        return len(self._waiting)
