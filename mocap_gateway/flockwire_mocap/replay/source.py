"""Poses of an earlier trace, served again at its pace or faster, with stamps of now."""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Sequence
from pathlib import Path
from struct import error as StructError  # noqa: N812
from typing import NamedTuple

from flockwire.domain.pose import Pose
from flockwire.domain.quaternion import Quaternion
from flockwire.domain.vector import Vector
from flockwire.process.cores import Start
from flockwire.wire.cdr import MessageError
from flockwire.wire.codec import Message, decode
from flockwire.wire.keys import Key

from flockwire_mocap.tracking import ReportedBody, SourceState, TrackerFrame, framed


class RecordedPose(NamedTuple):
    """A recorded pose: ns since the trace's first pose, the drone, m in the field's frame, x y z w."""

    elapsed: int
    drone: int
    position: Vector
    orientation: Quaternion


class ReplaySource:
    """Serves `poses` in order of time, `pace` times as fast as recorded, from the first `take` on."""

    triggers: frozenset[Key] = frozenset()

    def __init__(self, start: Start) -> None:
        swarm = start.plan.swarm
        self.table = swarm.gateway.replay
        self._names = {i: str(swarm.body(i)) for i in swarm.tracked}
        self._poses: Sequence[RecordedPose] = ()
        self._times: list[int] = []
        self._begun: int | None = None
        self._next = self._frames = 0

    def load(self, poses: Sequence[RecordedPose]) -> None:
        """Serve these poses from the next `take` on."""
        self._poses = [pose for pose in poses if pose.drone in self._names]
        self._times = [pose.elapsed for pose in self._poses]
        self._begun, self._next = None, 0

    def receive(self, key: Key, message: Message, now: int) -> None:
        """Ignore it."""

    def complete(self) -> bool:
        """Return False: no message completes a frame."""
        return False

    def take(self, now: int) -> list[TrackerFrame]:
        """Return of each drone the newest pose that is due at `now` (Unix ns) and has not been returned."""
        if self._begun is None:
            self._begun = now
        pace = self.table.pace
        due = bisect_right(self._times, round((now - self._begun) * pace))
        newest = {pose.drone: pose for pose in self._poses[self._next : due]}
        self._next = max(self._next, due)
        measured = [(self._begun + round(pose.elapsed / pace), self._body(pose)) for pose in newest.values()]
        frames = framed(measured, self._frames, now)
        self._frames += len(frames)
        return frames

    def _body(self, pose: RecordedPose) -> ReportedBody:
        return ReportedBody(pose.drone, self._names[pose.drone], pose.position, pose.orientation, tracked=True)

    def state(self, now: int) -> SourceState:
        """Return why there are no poses."""
        over = self._poses and self._next >= len(self._poses)
        return SourceState(f"{self.table.trace} has ended" if over else "")


_TOPIC = re.compile(r"/\w+/uav(\d+)/pose")


def read_poses(path: Path) -> list[RecordedPose]:
    """Return all poses of a trace in the order of their stamps; raises OSError if there are none."""
    from mcap.exceptions import McapError  # noqa: PLC0415  (no other source needs them)
    from mcap.reader import NonSeekingReader  # noqa: PLC0415

    found: list[tuple[int, int, Pose]] = []
    with path.open("rb") as file:
        try:
            for _, channel, record in NonSeekingReader(file, validate_crcs=True).iter_messages(log_time_order=False):
                drone = _TOPIC.fullmatch(channel.topic)
                if drone is not None:
                    pose = decode(Pose, record.data)
                    found.append((pose.stamp, int(drone[1]), pose))
        except (McapError, MessageError, StructError) as error:  # cut off: what was read until then is served
            if not found:
                raise OSError(f"{path}: is not a trace: {error}") from error
    if not found:
        raise OSError(f"{path}: has no poses")
    found.sort(key=lambda row: row[:2])
    first = found[0][0]
    return [RecordedPose(stamp - first, drone, pose.position, pose.orientation) for stamp, drone, pose in found]
