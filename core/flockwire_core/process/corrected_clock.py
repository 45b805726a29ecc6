"""The timekeeping of a process on another host than the gateway: it requests swarm time, and corrects its own clock."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

from flockwire_core.control.clock_offset import DRIFT, Offset, OffsetEstimator
from flockwire_core.domain.time import SECOND, TimeReply, TimeRequest
from flockwire_core.process.timekeeping import UNKNOWN, Outgoing, Timekeeping
from flockwire_core.wire.codec import Message
from flockwire_core.wire.keys import TIME_REPLY, TIME_REQUEST, Key
from flockwire_core.wire.plan import Plan

FIRST, FASTEST = 200, SECOND // 20  # number of first requests, and ns between two of them, for any bound
FAST, SLOW = SECOND // 10, SECOND  # ns between two later ones: while the bound is above GOOD, and after
GOOD = 1_000_000  # ns
FAIR, MANY = 5_000_000, 16  # bound, ns, of the first estimate, or else its number of replies
SLEW = 0.002  # s per s of slow correction: 2 mm/s at 1 m/s
DEADBAND = 100_000  # ns
FAR = 50_000_000  # ns: beyond the bound by more, at once; the default bound with which a drone may take off


class CorrectedClock(Timekeeping):
    """Requests swarm time and corrects the own clock by `correct(ns to add)`."""

    def __init__(self, plan: Plan, identity: str, correct: Callable[[int], None]) -> None:
        super().__init__(plan, identity)
        self.keys = frozenset({Key(TIME_REPLY, identity)})
        self._request, self._correct = Key(TIME_REQUEST, identity), correct
        self._estimator = OffsetEstimator()
        self._offset: Offset | None = None
        self._correction, self._corrected = 0, False
        self._asked: deque[int] = deque(maxlen=64)  # pending requests: 3 s of them at first
        self._replies = 0
        self._stepped_by: Callable[[int], None] = lambda _: None
        self._sent = self._next = self._estimated = self._stepped = 0

    def receive(self, key: Key, message: Message, now: int) -> Outgoing:
        """Receive a reply; ignore those to another process of this identity."""
        own = now - self._correction
        if isinstance(message, TimeReply) and message.requested in self._asked:
            self._asked.remove(message.requested)
            if self._estimator.add(message.requested, message.received, message.stamp, own):
                self._replies += 1
                self._estimate(own)
        return ()

    def step(self, now: int) -> Outgoing:
        """Correct the clock further, and send a due request."""
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
        """Call `corrected` with the ns of each correction that is made at once, from now on."""
        self._stepped_by = corrected

    def _estimate(self, own: int) -> None:
        if self._offset is not None and own < self._estimated + SLOW:
            return
        offset = self._estimator.estimate(own)
        if not self._corrected and (offset is None or (offset.bound > FAIR and self._replies < MANY)):
            return  # a first error takes long to correct
        self._estimated, self._offset = own, offset
        if not self._corrected:  # once known, the time is right
            self._follow(own)

    def _follow(self, own: int) -> None:
        """Move the correction to the estimate: at once if it is new or far off, else slowly, so that no drone jerks.

        On a link that is slower in one direction the estimate is wrong, by the bound at most: what lies further than
        FAR within the bound stays, since nothing shows that it is wrong.
        """
        elapsed, self._stepped = max(0, own - self._stepped) if self._stepped else 0, own
        if self._offset is None:
            return
        error, doubt = self._offset.offset - self._correction, max(self._offset.bound - FAR, DEADBAND)
        if abs(error) > (FAR + self._offset.bound if self._corrected else doubt):
            self._correct_by(error)
            self._stepped_by(error)
        elif abs(error) > doubt:
            most = round(SLEW * elapsed)
            self._correct_by(max(-most, min(most, error)))
        self._corrected = True

    def _correct_by(self, change: int) -> None:
        self._correction += change
        self._correct(self._correction)
