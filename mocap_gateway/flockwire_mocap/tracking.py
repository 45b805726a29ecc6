"""The gateway's interface to a tracking system, simulated or real: frames of bodies, stamped by the source's clock."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import isfinite
from typing import Final, NamedTuple, Protocol

from flockwire_core.compiling import mypyc_attr
from flockwire_core.domain.pose import LEVEL, Pose, Quaternion
from flockwire_core.domain.record import Record
from flockwire_core.domain.vector import Vector
from flockwire_core.process.cores import Randomness
from flockwire_core.wire.codec import Message
from flockwire_core.wire.keys import Key
from flockwire_core.wire.status import Counts

NO_FRAMES = "no frames arrive: does the tracker still stream?"
LOST = (0.0, 0.0, 0.0)  # position of a body that the tracker does not see


@mypyc_attr(acyclic=True)
class ReportedBody(Record):
    """One body of a frame, in the tracker's terms.

    Attributes:
        identity: the tracker's number of the body.
        name: the tracker's name of it; None while the tracker has not sent it.
        position: unit and axes of the source (the tracker's frame) until `Coordinates` has converted it.
        orientation: unit quaternion x, y, z, w, body to the same frame.
        tracked: False if the body is lost and the pose not measured.

    """

    __slots__ = ("identity", "name", "position", "orientation", "tracked")

    def __init__(
        self, identity: int, name: str | None, position: Vector, orientation: Quaternion, tracked: bool
    ) -> None:
        self.identity: Final = identity
        self.name: Final = name
        self.position: Final = position
        self.orientation: Final = orientation
        self.tracked: Final = tracked


def unseen(identity: int, name: str | None) -> ReportedBody:
    """Return a body that the tracker does not see."""
    return ReportedBody(identity, name, LOST, LEVEL, tracked=False)


class TrackerFrame(NamedTuple):
    """All bodies of one exposure, or of one report if a protocol reports single bodies.

    Attributes:
        number: counts up by one from frame to frame.
        captured: exposure time, ns of the source's clock.
        transmitted: send time, ns of the same clock; `captured` if the protocol does not carry it.
        bodies: the bodies in the order of the source.
        set_back: whether the source's clock is known to have been set back since the frame before it.

    """

    number: int
    captured: int
    transmitted: int
    bodies: tuple[ReportedBody, ...]
    set_back: bool = False


Drone = tuple[int, Pose]
"""A drone, and the pose of the body that has its name at the tracker."""


def owner(drones: Mapping[str | int, int], identity: int, name: str | None) -> int | None:
    """Return whose of `drones` (by body) the body with this number and name is, the name first; None: no drone's."""
    drone = drones.get(name) if name is not None else None
    return drones.get(identity) if drone is None else drone


def framed(measured: Iterable[tuple[int, ReportedBody]], first: int, now: int) -> list[TrackerFrame]:
    """Return bodies as frames, one for each capture time (ns), the earliest first.

    `first` is the number of the first frame, `now` the send time of all (ns).
    """
    frames: dict[int, list[ReportedBody]] = {}
    for captured, body in measured:
        frames.setdefault(captured, []).append(body)
    return [TrackerFrame(number, at, now, tuple(frames[at])) for number, at in enumerate(sorted(frames), first)]


def is_pose(position: Vector, orientation: Quaternion) -> bool:
    """Return whether these are a valid pose: finite numbers, a quaternion of unit length."""
    x, y, z, w = orientation
    length = x * x + y * y + z * z + w * w  # NaN and infinity fail the comparison
    # of the squared norm: single precision and a tracker's rounding stay far below
    return abs(length - 1.0) < 0.02 and isfinite(sum(position))


def noisy(vector: Vector, noise: float, chance: Randomness) -> Vector:
    """Return `vector` with noise of this standard deviation per axis, drawn from `chance`."""
    x, y, z = vector
    return (x + chance.gauss(0.0, noise), y + chance.gauss(0.0, noise), z + chance.gauss(0.0, noise))


class SourceState(NamedTuple):
    """The state of a tracking system: its problem, and its counts."""

    trouble: str = ""  # why there are no frames, and the remedy; empty while they arrive
    counts: Counts = ()  # of bad frames and packets, by kind


class Source(Protocol):
    """A tracking system; its units, axes, clock and faults are internal to it.

    A source decides when a frame is complete: with each message if it receives whole frames (NatNet, Qualisys, Vicon,
    replay), by the rules of completeness.py if it receives single bodies (VRPN, simulated).
    """

    @property
    def triggers(self) -> frozenset[Key]:
        """The keys whose messages may complete a frame."""

    def receive(self, key: Key, message: Message, now: int) -> None:
        """Receive any message that the gateway received at `now` (Unix ns); ignores those that it does not need."""

    def complete(self) -> bool:
        """Return whether the last message completed a frame."""

    def take(self, now: int) -> list[TrackerFrame]:
        """Return the measurements since the last call that are available by `now` (Unix ns), complete or not.

        Only the newest measurement of each body: on the field (ENU, m), stamped by the gateway's clock.
        """

    def state(self, now: int) -> SourceState:
        """Return its state at `now` (Unix ns)."""
