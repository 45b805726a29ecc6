"""What a tracking system is to the gateway: whatever measures the bodies, simulated or real, looks like this."""

from __future__ import annotations

from typing import NamedTuple, Protocol

from flockwire.wire.codec import Message
from flockwire.wire.keys import Key
from flockwire.wire.status import Counts

from flockwire_mocap.tracking import TrackerFrame


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
