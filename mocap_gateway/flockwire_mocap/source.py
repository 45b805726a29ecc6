"""The gateway's interface to a tracking system, simulated or real."""

from __future__ import annotations

from typing import NamedTuple, Protocol

from flockwire.wire.codec import Message
from flockwire.wire.keys import Key
from flockwire.wire.status import Counts

from flockwire_mocap.tracking import TrackerFrame


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
