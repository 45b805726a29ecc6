"""What a tracking system is to the gateway: whatever measures the bodies, simulated or real, looks like this."""

from __future__ import annotations

from typing import NamedTuple, Protocol

from flockwire.control.vector import Vector
from flockwire.wire.keys import Key
from flockwire.wire.messages import Message

Orientation = tuple[float, float, float, float]


class TrackedBody(NamedTuple):
    """One drone in one frame, as it was measured. A body that was not seen is not in the frame."""

    stamp: int  # when it was there, Unix ns on the gateway's clock; those of one frame need not be equal
    drone: int
    position: Vector  # m, world frame
    orientation: Orientation  # quaternion x y z w, body to world frame


class Source(Protocol):
    """A tracking system; its units, axes, clock, names of bodies and faults are internal to it.

    A source decides when a frame is complete: one that receives whole frames (NatNet, Qualisys, Vicon, a replay) with
    each message, one that receives body by body (VRPN, the simulated one) by the rules of completeness.py.
    """

    @property
    def triggers(self) -> frozenset[Key]:
        """The keys whose messages may complete a frame."""

    @property
    def waits_for(self) -> str:
        """What is missing when no frames come, for the status."""

    def receive(self, key: Key, message: Message, now: int) -> None:
        """Take in any message that the gateway received at `now` (Unix ns); what it does not need it ignores."""

    def complete(self) -> bool:
        """Return whether the message that was just received completed a frame."""

    def take(self, now: int) -> list[TrackedBody]:
        """Return what has been measured since the last call and is available by `now` (Unix ns), complete or not."""
