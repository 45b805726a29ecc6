"""A tracking system with its own connection: its frames are counted, its clock and axes converted here, once."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Mapping

from flockwire_core.domain.time import nanoseconds
from flockwire_core.swarm.gateway import Gateway
from flockwire_core.wire.codec import Message
from flockwire_core.wire.keys import MISSION, Key
from flockwire_core.wire.status import OTHERS, counted

from flockwire_mocap.completeness import Completeness
from flockwire_mocap.coordinates import coordinates_of
from flockwire_mocap.source_clock import SourceClock
from flockwire_mocap.tracking import ReportedBody, SourceState, TrackerFrame, framed

MOST_NAMED = 8  # bodies, or senders, that a count of the status names; the others are one sum
MOST_SENDERS = 2048  # senders whose clocks are followed; beyond that the oldest clock begins again
TWICE, STEPPED = "{} twice in a frame", "steps of the clock of {}"
WINDOW = 32  # frames that one may be late: networks reorder by few; a recording played in a loop jumps by more
MISSING, LATE, RESTARTS = "frames missing", "frames late", "stream restarts"


class FrameSequence:
    """Counts in `counts` missing, repeated and late frames and restarts of a stream whose numbers count up by one.

    A late frame was counted as missing before and no longer is. A number further behind than WINDOW is late; if a
    second one follows it, the stream has restarted.
    """

    def __init__(self, counts: Counter[str]) -> None:
        self._counts = counts
        self._last: int | None = None
        self._restart: int | None = None  # the newest number far behind, with which a stream may have restarted
        self._recent: deque[int] = deque(maxlen=2 * WINDOW)

    def arrived(self, number: int) -> bool:
        """Count the frame `number`; return whether it is newer than all before."""
        if self._last is None or number > self._last:
            self._counts[MISSING] += 0 if self._last is None else number - self._last - 1
        elif self._last - number < WINDOW:
            self._behind(number)
            return False
        elif self._restart is not None and 0 < number - self._restart <= WINDOW:
            self._counts[RESTARTS] += 1
            self._recent.clear()
        else:
            self._restart = number
            self._counts[LATE] += 1
            return False
        self._last, self._restart = number, None
        self._recent.append(number)
        return True

    def _behind(self, number: int) -> None:
        if number in self._recent:
            self._counts["frames repeated"] += 1
            return
        self._recent.append(number)
        self._counts[LATE] += 1
        self._counts[MISSING] = max(0, self._counts[MISSING] - 1)


class StreamedSource:
    """Takes a tracker's frames, and keeps the newest measurement of each body.

    A newer measurement replaces the older one; there is no queue. The send time of a frame is mapped from its sender's
    clock to the gateway's; then the tracker's delay from exposure to sending is subtracted. Each sender has a clock of
    its own: what one stamps never moves the poses of another.

    Args:
        gateway: its table has the map from the tracker's axes to the field, and the rate of frames.
        failure: the problem at first.
        latency: s from exposure to the stamp, if the tracker's stamps do not include it.
        awaited: the drones by body, if the protocol reports single bodies; None if frames are whole.

    """

    triggers = frozenset({MISSION})  # frames trigger steps; the gateway steps otherwise only without frames

    def __init__(
        self, gateway: Gateway, failure: str = "", latency: float = 0.0, awaited: Mapping[str | int, int] | None = None
    ) -> None:
        self._coordinates, self._latency = coordinates_of(gateway), nanoseconds(latency)
        self.failure = failure  # the problem of the connection and its remedy in one line; empty while connected
        self.counts: Counter[str] = Counter()  # of bad frames and packets, by kind
        self._awaited = awaited or {}
        self._completeness = Completeness(tuple(awaited.values()), 1.0 / gateway.rate_hz) if awaited else None
        self._named: dict[str, Counter[str]] = {}  # by what is counted, then by whose it is
        self._clocks: dict[str, SourceClock] = {}  # by sender
        self._complete = False
        self._frames = 0
        self._newest: dict[int, tuple[int, ReportedBody]] = {}  # by the tracker's number: capture time, body

    def arrived(self, frame: TrackerFrame, now: int, sender: str = "", whole: bool = False) -> None:
        """Receive a frame that arrived at `now` (Unix ns), newer than all before of its `sender`, who stamped it.

        A `whole` frame has all bodies that its sender sees, of a protocol that otherwise reports single ones.
        """
        if sender not in self._clocks:
            if len(self._clocks) >= MOST_SENDERS:
                del self._clocks[next(iter(self._clocks))]
            self._clocks[sender] = SourceClock()
        clock = self._clocks[sender]
        steps = clock.steps
        sent = clock.update(frame.transmitted, now, frame.set_back)
        if clock.steps > steps:
            self.count_named(STEPPED, sender)
        captured = sent - (frame.transmitted - frame.captured) - self._latency
        self._hold(captured, frame.bodies)
        self._complete = self._complete or whole or self._completes(frame.bodies, now)

    def sender_name(self, sender: str) -> str:
        """Return what the status calls a sender."""
        return sender or "the tracker"

    def count_named(self, what: str, who: str) -> None:
        """Count `what` of a body or sender, whose name takes the place of {} in it; of many the first are shown."""
        counts = self._named.setdefault(what, Counter())
        counts[who if who in counts or len(counts) < MOST_NAMED else OTHERS] += 1

    def _hold(self, captured: int, bodies: tuple[ReportedBody, ...]) -> None:
        """Keep the newest of each body; a body that is in the frame twice is dropped, because one of both is wrong."""
        here: dict[int, ReportedBody] = {}
        for body in bodies:
            if body.identity in here:
                self.count_named(TWICE, str(body.name or body.identity))
                body = body._replace(tracked=False)  # noqa: PLW2901
            here[body.identity] = body
        for identity, body in here.items():
            self._newest[identity] = (captured, body)

    def _completes(self, bodies: tuple[ReportedBody, ...], now: int) -> bool:
        if self._completeness is None:
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
        named: Counter[str] = Counter()
        for what, counts in self._named.items():
            for who, count in counts.items():
                named[what.format(self.sender_name(who))] += count
        return SourceState(self.trouble(now), counted(*self.counts.items(), *named.items()))

    def trouble(self, now: int) -> str:
        """Return why there are no frames at `now` (Unix ns), and the remedy; empty while they arrive."""
        return self.failure
