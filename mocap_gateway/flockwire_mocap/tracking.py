"""What every tracking system is to the gateway, whatever its protocol: a source of frames of bodies."""

from __future__ import annotations

from collections.abc import Iterable
from math import isfinite
from typing import NamedTuple, Protocol

from flockwire.domain.vector import Vector
from flockwire.wire.keys import Key
from flockwire.wire.messages import Message
from flockwire.wire.status import Counts

from flockwire_mocap.quaternion import IDENTITY, Quaternion

UNIT_TOLERANCE = 0.02  # of the squared norm: single precision and a tracker's rounding stay far below
LOST = (0.0, 0.0, 0.0)  # where a tracker says that a body is that it does not see


class ReportedBody(NamedTuple):
    """One body of a frame, as the tracker has it.

    Attributes:
        identity: the tracker's number of the body.
        name: the tracker's name of it; None while the tracker has not sent it.
        position: unit and axes of the source (the tracker's frame) until `Coordinates` has converted it.
        orientation: unit quaternion x, y, z, w, body to the same frame.
        tracked: False where the pose is not a measurement: the body is lost.

    """

    identity: int
    name: str | None
    position: Vector
    orientation: Quaternion
    tracked: bool


def unseen(identity: int, name: str | None) -> ReportedBody:
    """Return a body that the tracker does not see."""
    return ReportedBody(identity, name, LOST, IDENTITY, tracked=False)


class TrackerFrame(NamedTuple):
    """All bodies of one exposure, or of one report where a protocol reports each body alone.

    Attributes:
        number: counts up by one from frame to frame.
        captured: when the cameras saw it, ns of the source's clock.
        transmitted: when the source sent it, ns of the same clock; `captured` where a protocol does not carry it.
        bodies: the bodies in the order of the source.
        set_back: whether the source's clock is known to have been set back since the frame before it.

    """

    number: int
    captured: int
    transmitted: int
    bodies: tuple[ReportedBody, ...]
    set_back: bool = False


def framed(measured: Iterable[tuple[int, ReportedBody]], first: int, now: int) -> list[TrackerFrame]:
    """Return bodies as frames, a frame for each time (ns) at which some were captured, the earliest first.

    `first` is the number of the first frame, `now` when all of them count as transmitted (ns).
    """
    frames: dict[int, list[ReportedBody]] = {}
    for captured, body in measured:
        frames.setdefault(captured, []).append(body)
    return [TrackerFrame(number, at, now, tuple(frames[at])) for number, at in enumerate(sorted(frames), first)]


def is_pose(position: Vector, orientation: Quaternion) -> bool:
    """Return whether these can be a measured pose: finite numbers, a quaternion of unit length."""
    x, y, z, w = orientation
    length = x * x + y * y + z * z + w * w  # NaN and infinity fail the comparison
    return abs(length - 1.0) < UNIT_TOLERANCE and isfinite(sum(position))


class SourceState(NamedTuple):
    """How a tracking system is connected: what it lacks, and what it has counted."""

    trouble: str = ""  # why no frames come, and what to do; empty while they come
    counts: Counts = ()  # of frames and packets that were not as they should be, by what was wrong


class Source(Protocol):
    """A tracking system; its units, axes, clock and faults are internal to it.

    A source decides when a frame is complete: one that receives whole frames (NatNet, Qualisys, Vicon, a replay) with
    each message, one that receives body by body (VRPN, the simulated one) by the rules of completeness.py.
    """

    @property
    def triggers(self) -> frozenset[Key]:
        """The keys whose messages may complete a frame."""

    def receive(self, key: Key, message: Message, now: int) -> None:
        """Take in any message that the gateway received at `now` (Unix ns); what it does not need it ignores."""

    def complete(self) -> bool:
        """Return whether what was just received completed a frame."""

    def take(self, now: int) -> list[TrackerFrame]:
        """Return what was measured since the last call and is available by `now` (Unix ns), complete or not.

        Of each body only the newest measurement: on the field (ENU, m), stamped by the gateway's clock.
        """

    def state(self, now: int) -> SourceState:
        """Return how it is connected at `now` (Unix ns)."""
