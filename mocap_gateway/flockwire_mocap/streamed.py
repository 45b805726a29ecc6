"""A tracking system with its own connection: its clock and axes are converted here, once."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

from flockwire.domain.time import nanoseconds
from flockwire.swarm.gateway import Gateway
from flockwire.wire.codec import Message
from flockwire.wire.keys import MISSION, Key
from flockwire.wire.status import OTHERS, counted

from flockwire_mocap.completeness import Completeness
from flockwire_mocap.coordinates import Coordinates
from flockwire_mocap.source_clock import SourceClock
from flockwire_mocap.tracking import ReportedBody, SourceState, TrackerFrame, framed

MOST_TWICE = 8  # duplicated bodies that the status names; the others are one sum


class StreamedSource:
    """Takes a tracker's frames, and keeps the newest measurement of each body.

    A newer measurement replaces the older one; there is no queue. The send time of a frame is mapped to the gateway's
    clock; then the tracker's delay from exposure to sending is subtracted.

    Args:
        gateway: its table has the map from the tracker's axes to the field, and the rate of frames.
        failure: the problem at first.
        latency: s from exposure to the stamp, if the tracker's stamps do not include it.
        awaited: the drones by body, if the protocol reports single bodies; None if frames are whole.

    """

    triggers = frozenset({MISSION})  # frames trigger steps; the gateway steps otherwise only without frames

    def __init__(
        self,
        gateway: Gateway,
        failure: str = "",
        latency: float = 0.0,
        awaited: Mapping[str | int, int] | None = None,
    ) -> None:
        self._coordinates, self._latency = coordinates_of(gateway), nanoseconds(latency)
        self.failure = failure  # the problem of the connection and its remedy in one line; empty while connected
        self.counts: Counter[str] = Counter()  # of bad frames and packets, by kind
        self._awaited = awaited
        bodies = None if awaited is None else tuple(awaited.values())
        self._completeness = None if bodies is None else Completeness(bodies, 1.0 / gateway.rate_hz)
        self._twice: Counter[str] = Counter()
        self._clock = SourceClock()
        self._complete = False
        self._frames = 0
        self._newest: dict[int, tuple[int, ReportedBody]] = {}  # by the tracker's number: capture time, body

    def arrived(self, frame: TrackerFrame, now: int) -> None:
        """Receive a frame that arrived at `now` (Unix ns), newer than all before."""
        sent = self._clock.update(frame.transmitted, now, frame.set_back)
        captured = sent - (frame.transmitted - frame.captured) - self._latency
        self._hold(captured, frame.bodies)
        self._complete = self._complete or self._completes(frame.bodies, now)

    def _hold(self, captured: int, bodies: tuple[ReportedBody, ...]) -> None:
        """Keep the newest of each body; a body that is in the frame twice is dropped, because one of both is wrong."""
        here: dict[int, ReportedBody] = {}
        for body in bodies:
            if body.identity in here:
                who = str(body.name or body.identity)
                self._twice[who if who in self._twice or len(self._twice) < MOST_TWICE else OTHERS] += 1
                body = body._replace(tracked=False)  # noqa: PLW2901
            here[body.identity] = body
        for identity, body in here.items():
            self._newest[identity] = (captured, body)

    def _completes(self, bodies: tuple[ReportedBody, ...], now: int) -> bool:
        if self._completeness is None or self._awaited is None:
            return True
        complete = False
        for body in bodies:
            drone = self._awaited.get(body.name or "")
            if drone is not None:
                complete = self._completeness.report(drone, now) or complete
        return complete

    def receive(self, key: Key, message: Message, now: int) -> None:
        """Ignore it: a real tracker sends nothing over the swarm's network."""

    def complete(self) -> bool:
        """Return whether the data since the last call to `take` completed a frame."""
        return self._complete

    def take(self, now: int) -> list[TrackerFrame]:
        """Return the newest measurement of each body since the last call, on the field."""
        newest, self._newest, self._complete = self._newest, {}, False
        on_field = self._coordinates.body
        measured = [(captured, on_field(body) if body.tracked else body) for captured, body in newest.values()]
        frames = framed(measured, self._frames, now)
        self._frames += len(frames)
        return frames

    def state(self, now: int) -> SourceState:
        """Return its state at `now` (Unix ns)."""
        twice = [(f"{who} twice in a frame", count) for who, count in self._twice.items()]
        counts = counted(*self.counts.items(), ("steps of its clock", self._clock.steps), *twice)
        return SourceState(self.trouble(now), counts)

    def trouble(self, now: int) -> str:
        """Return why there are no frames at `now` (Unix ns), and the remedy; empty while they arrive."""
        return self.failure


def coordinates_of(gateway: Gateway) -> Coordinates:
    """Return the map from the frame of the tracker in `gateway` to the field."""
    table = gateway.table
    return Coordinates(table.up_axis, table.unit, gateway.rotation, gateway.offset)
