"""Swarm time: all hosts count by the gateway's clock. Each process elsewhere asks for it and corrects its own.

What runs a core (shell, virtual process) hands it corrected time, and does not begin before that is known. No core
knows of it but a driver, which begins at once and is told of each correction. Processes on the gateway's host
share its clock and ask nothing.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from math import inf
from typing import Protocol

from flockwire.control.clock_offset import DRIFT, Offset, OffsetEstimator
from flockwire.domain.time import SECOND, TimeReply, TimeRequest
from flockwire.wire.codec import Message
from flockwire.wire.keys import TIME_REPLY, TIME_REQUEST, Key
from flockwire.wire.plan import Plan

FIRST, FASTEST = 200, SECOND // 20  # the first requests, and the ns between two of them, whatever the bound
FAST, SLOW = SECOND // 10, SECOND  # ns between two later ones: while the bound is above GOOD, and otherwise
GOOD = 1_000_000  # ns
FAIR, MANY = 5_000_000, 16  # the bound, ns, that the first estimate must have, or the replies that it must be of
OUTSTANDING = 64  # requests whose replies may still come: 3 s of them at first
STEP = 50_000_000  # ns beyond its bound by which an offset must be off to be corrected at once
SLEW = 0.002  # s per s by which the time is corrected otherwise: 2 mm/s at 1 m/s
DEADBAND = 100_000  # ns
UNKNOWN = -1.0
PATIENCE = 3.0  # s that a process waits for swarm time before it begins; one that flies a drone by poses waits longer

Outgoing = tuple[tuple[Key, Message], ...]


class Timekeeping(Protocol):
    """A process's part in the swarm's time."""

    keys: frozenset[Key]

    def receive(self, key: Key, message: Message, now: int) -> Outgoing:
        """Receive a message of `keys` that came at `now`, swarm time in ns; returns what to publish at once."""

    def step(self, now: int) -> Outgoing:
        """Return what to publish at `now`; called at least ten times a second."""

    def figures(self, now: int) -> tuple[float, float]:
        """Return the offset that is corrected and its bound, s; the bound is UNKNOWN before the first replies."""

    def follow(self, corrected: Callable[[int], None]) -> None:
        """Call `corrected` with the ns of each correction from now on."""


def is_known(timed: Timekeeping, now: int) -> bool:
    """Return whether swarm time is known at `now`."""
    return timed.figures(now)[1] >= 0.0


def patience(plan: Plan, identity: str) -> float:
    """Return how long, s, a process waits at most for swarm time before it begins.

    A pilot has no poses either where the gateway is silent, and by a wrong clock it would obey what was ordered before
    it began. A driver has setpoints to end and a stop to hear. Any other does what it can after a while.
    """
    if identity in plan.pilots.values():
        return inf
    return 0.0 if plan.rows[identity].untimed else PATIENCE


class SharedClock:
    """Has the swarm's clock already; answers those who ask for it, if anybody does."""

    def __init__(self, plan: Plan, identity: str) -> None:
        answered = [key.owner for key in plan.publishes[identity] if key.kind == TIME_REPLY]
        self.keys = frozenset(Key(TIME_REQUEST, owner) for owner in answered)
        self._frame = plan.swarm.frame

    def receive(self, key: Key, message: Message, now: int) -> Outgoing:
        """Answer: it came at `now`, and the answer leaves at `now`."""
        return ((Key(TIME_REPLY, key.owner), TimeReply(now, self._frame, message.stamp, now)),)

    def step(self, now: int) -> Outgoing:
        """Publish nothing."""
        return ()

    def figures(self, now: int) -> tuple[float, float]:
        """Return that it is right."""
        return 0.0, 0.0

    def follow(self, corrected: Callable[[int], None]) -> None:
        """Do nothing: nothing is corrected."""


class CorrectedClock:
    """Asks for the swarm's time and has the own clock corrected, by `correct(ns that are to be added to it)`."""

    def __init__(self, plan: Plan, identity: str, correct: Callable[[int], None]) -> None:
        self.keys = frozenset({Key(TIME_REPLY, identity)})
        self._request, self._frame, self._correct = Key(TIME_REQUEST, identity), plan.swarm.frame, correct
        self._estimator = OffsetEstimator()
        self._offset: Offset | None = None
        self._correction, self._corrected = 0, False
        self._asked: deque[int] = deque(maxlen=OUTSTANDING)
        self._replies = 0
        self._corrected_by: Callable[[int], None] = _nothing
        self._sent = self._next = self._estimated = self._stepped = 0

    def receive(self, key: Key, message: Message, now: int) -> Outgoing:
        """Take a reply in; ignore those to another process of this identity."""
        own = now - self._correction
        if isinstance(message, TimeReply) and message.requested in self._asked:
            self._asked.remove(message.requested)
            if self._estimator.add(message.requested, message.received, message.stamp, own):
                self._replies += 1
                self._estimate(own)
        return ()

    def step(self, now: int) -> Outgoing:
        """Correct the clock a little further, and ask again when it is time."""
        own = now - self._correction
        if own < self._next - SLOW:  # the own clock was set back
            self._next = self._estimated = own
        self._follow(own)
        if own < self._next:
            return ()
        self._asked.append(own)
        self._sent += 1
        good = self._offset is not None and self._offset.bound <= GOOD
        self._next = own + (FASTEST if self._sent < FIRST else SLOW if good else FAST)
        return ((self._request, TimeRequest(own, self._frame)),)

    def figures(self, now: int) -> tuple[float, float]:
        """Return the offset that is corrected and its bound, s; the bound is UNKNOWN before the first replies."""
        if self._offset is None:
            return self._correction / SECOND, UNKNOWN
        since = max(0, now - self._correction - self._estimated)  # both clocks may have drifted apart meanwhile
        return self._correction / SECOND, (self._offset.bound + DRIFT * since) / SECOND

    def follow(self, corrected: Callable[[int], None]) -> None:
        """Call `corrected` with the ns of each correction from now on."""
        self._corrected_by = corrected

    def _estimate(self, own: int) -> None:
        if self._offset is not None and own < self._estimated + SLOW:
            return
        offset = self._estimator.estimate(own)
        if not self._corrected and (offset is None or (offset.bound > FAIR and self._replies < MANY)):
            return  # what it is off by at first takes long to correct
        self._estimated, self._offset = own, offset
        if not self._corrected:  # once known, the time is right
            self._follow(own)

    def _follow(self, own: int) -> None:
        """Bring the correction to the estimate: at once when it is new or far off, else too slowly to jerk anybody."""
        elapsed, self._stepped = max(0, own - self._stepped) if self._stepped else 0, own
        if self._offset is None:
            return
        error = self._offset.offset - self._correction
        if abs(error) > (STEP + self._offset.bound if self._corrected else DEADBAND):
            self._correct_by(error)
        elif abs(error) > DEADBAND:
            most = round(SLEW * elapsed)
            self._correct_by(max(-most, min(most, error)))
        self._corrected = True

    def _correct_by(self, change: int) -> None:
        self._correction += change
        self._correct(self._correction)
        self._corrected_by(change)


def _nothing(_: int) -> None:
    pass


def timekeeping(plan: Plan, identity: str, correct: Callable[[int], None]) -> Timekeeping:
    """Return the part of `identity` in the swarm's time."""
    if Key(TIME_REQUEST, identity) in plan.publishes[identity]:
        return CorrectedClock(plan, identity, correct)
    return SharedClock(plan, identity)
