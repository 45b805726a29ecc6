"""Poses of an earlier trace, or of a bag, served again at their pace or faster, with stamps of now."""

from __future__ import annotations

import asyncio
from bisect import bisect_right
from collections.abc import AsyncIterator, Iterable, Iterator, Sequence
from contextlib import asynccontextmanager
from pathlib import Path
from struct import error as StructError  # noqa: N812

from flockwire_core.domain.time import SECOND
from flockwire_core.process.cores import Start
from flockwire_core.ros import messages
from flockwire_core.ros.messages import POSE_TYPES, NamedPose
from flockwire_core.swarm.gateway import Replay
from flockwire_core.swarm.model import Swarm
from flockwire_core.swarm.reading import stat_file
from flockwire_core.trace_files import parts
from flockwire_core.wire.cdr import MessageError
from flockwire_core.wire.codec import Message
from flockwire_core.wire.keys import Key
from mcap.exceptions import McapError
from mcap.reader import NonSeekingReader

from flockwire_mocap.body_names import BodyNames, LengthError
from flockwire_mocap.coordinates import coordinates_of
from flockwire_mocap.tracking import ReportedBody, SourceState, TrackerFrame, framed, is_pose

STEP = SECOND  # ns between the clock of a topic's stamps and that of the recording, from which on one was set
MOST_SHOWN = 8  # topics that a message names


class ReplaySource:
    """Serves poses in order of time, `pace` times as fast as recorded, from the first `take` on.

    Their stamps are ns since the first one, in the frame of the recording.
    """

    triggers: frozenset[Key] = frozenset()

    def __init__(self, start: Start) -> None:
        self.swarm = swarm = start.plan.swarm
        self.table = swarm.gateway.replay
        self._drones = {str(swarm.body(i)): i for i in swarm.tracked}
        self._numbers = dict(self._drones)
        self._coordinates = coordinates_of(swarm.gateway) if self.table.foreign else None
        self._poses: Sequence[NamedPose] = ()
        self._times: list[int] = []
        self._begun: int | None = None
        self._next = self._frames = 0

    def load(self, poses: Sequence[NamedPose]) -> None:
        """Serve these poses from the next `take` on; raises OSError if none is of a drone."""
        bodies = dict.fromkeys(pose.name for pose in poses)
        if not self._drones.keys() & bodies:
            raise OSError(
                f"has no poses of {_several(self._drones)}, but of {_several(bodies)}: set `body` of [[drones]]"
            )
        self._poses = poses
        self._times = [pose.stamp for pose in self._poses]
        self._begun, self._next = None, 0

    def receive(self, key: Key, message: Message, now: int) -> None:
        """Ignore it."""

    def complete(self) -> bool:
        """Return False: no message completes a frame."""
        return False

    def take(self, now: int) -> list[TrackerFrame]:
        """Return of each body the newest pose that is due at `now` (Unix ns) and has not been returned."""
        if self._begun is None:
            self._begun = now
        pace = self.table.pace
        due = bisect_right(self._times, round((now - self._begun) * pace))
        newest = {pose.name: pose for pose in self._poses[self._next : due]}
        self._next = max(self._next, due)
        measured = [(self._begun + round(pose.stamp / pace), self._body(pose)) for pose in newest.values()]
        frames = framed(measured, self._frames, now)
        self._frames += len(frames)
        return frames

    def _body(self, pose: NamedPose) -> ReportedBody:
        number = self._numbers.setdefault(pose.name, max(self._numbers.values()) + 1)
        body = ReportedBody(number, pose.name, pose.position, pose.orientation, tracked=True)
        return body if self._coordinates is None else self._coordinates.body(body)

    def state(self, now: int) -> SourceState:
        """Return why there are no poses."""
        over = self._poses and self._next >= len(self._poses)
        return SourceState(f"{self.table.trace} has ended" if over else "")


@asynccontextmanager
async def loaded(source: ReplaySource, _: object) -> AsyncIterator[None]:
    """Have `source` serve its trace during the context; raises OSError if that cannot be read."""
    trace = source.table.trace
    try:
        source.load(await asyncio.to_thread(read_poses, Path(trace), source.swarm))
    except OSError as error:
        raise OSError(f"gateway.replay.trace = {trace!r}: {error.strerror or error}") from error
    yield


def read_poses(path: Path, swarm: Swarm) -> list[NamedPose]:
    """Return all poses of a recording, of all its parts, in the order of their time; raises OSError without any."""
    table = swarm.gateway.replay
    names = BodyNames(table, swarm)
    found, others, times = list[NamedPose](), dict[str, None](), Times()
    broken: OSError | None = None
    for part in parts(path):
        try:
            found.extend(_poses_in(part, names, others, times))  # keeps what it has at an error
        except (McapError, MessageError, LengthError, StructError) as error:  # cut off: what was read is served
            broken = OSError(f"that can be read: {error}")
    if not found:
        raise OSError(f"{path}: has no poses {broken or _elsewhere(table, others)}") from broken
    first = min(pose.stamp for pose in found)
    return sorted([pose._replace(stamp=pose.stamp - first) for pose in found], key=lambda pose: pose[:2])


def _elsewhere(table: Replay, others: Iterable[str]) -> str:
    """Return where no poses are, and where some are."""
    there = _several(others)
    where = f"; poses are on {there}: set gateway.replay.topic or array" if there else ""
    return f"on {table.array or table.topic or '/SWARM/uavN/pose'}{where}"


def _poses_in(path: Path, names: BodyNames, others: dict[str, None], times: Times) -> Iterator[NamedPose]:
    """Yield the poses on the topics that match `names`, as they come; add the topics of all others to `others`."""
    stat_file(path)  # raises OSError for a pipe, which would be waited for
    with path.open("rb") as file:
        reader = NonSeekingReader(file, validate_crcs=True)
        for schema, channel, record in reader.iter_messages(log_time_order=False):
            kind = schema.name if schema is not None else ""
            if kind not in POSE_TYPES:
                continue
            if not names.matches(channel.topic, kind):
                others[channel.topic] = None
                continue
            for name, one in names.of(channel.topic, kind, messages.read_poses(kind, record.data)):
                if is_pose(one.position, one.orientation):
                    at = times.of(channel.topic, one.stamp, record.log_time)
                    yield NamedPose(at, name, one.position, one.orientation)


class Times:
    """Maps the stamps of each topic to one time, the recording's: a clock that was set back changes no order.

    Stamps differ from the time of recording by the same for all topics, until one differs by more than STEP.
    """

    def __init__(self) -> None:
        self._first: int | None = None
        self._offsets: dict[str, int] = {}  # ns, by topic

    def of(self, topic: str, stamp: int, recorded: int) -> int:
        """Return the time of a message of `topic` that was `recorded` then (ns)."""
        if stamp <= 0:
            return recorded
        if self._first is None:
            self._first = recorded - stamp
        offset = self._offsets.setdefault(topic, self._first)
        if abs(recorded - stamp - offset) > STEP:
            offset = self._offsets[topic] = recorded - stamp
        return stamp + offset


def _several(names: Iterable[str]) -> str:
    first = [*names]
    return ", ".join(first[:MOST_SHOWN]) + (f" and {len(first) - MOST_SHOWN} more" if len(first) > MOST_SHOWN else "")
