"""Reads the poses of drones from a trace, as far as it goes."""

from __future__ import annotations

import re
from pathlib import Path
from struct import error as StructError  # noqa: N812

from flockwire.domain.pose import Pose
from flockwire.wire.cdr import MessageError
from flockwire.wire.codec import decode
from mcap.exceptions import McapError
from mcap.reader import NonSeekingReader

from flockwire_mocap.replay.source import RecordedPose

_TOPIC = re.compile(r"/\w+/uav(\d+)/pose")


def read_poses(path: Path) -> list[RecordedPose]:
    """Return all poses of a trace in the order of their stamps; raises OSError if there are none."""
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
