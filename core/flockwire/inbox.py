"""The gate that every received message passes: decoded, judged for freshness, counted when it is turned away."""

from __future__ import annotations

from collections import Counter
from struct import Struct, error
from typing import NamedTuple

from flockwire.cdr import MessageError
from flockwire.keys import Key, Row
from flockwire.messages import Message

BILLION = 1_000_000_000
ATTACHMENT = Struct("<qqB16s")  # as rmw_zenoh: sequence number, source time in ns, 16, publisher id
CANARY = b"flockwire canary"  # what the conformance probe says in place of a message: dropped, and counted as such
MOST_MISSED = 1_000_000  # a larger gap is somebody's joke, and must not overflow a counter
AHEAD = BILLION // 10  # ns by which a stamp may lie in the future: a bound on the offset between two machines' clocks


def attachment(sequence: int, sent: int, publisher: bytes) -> bytes:
    """Return what accompanies every sample: its number, when it was sent (Unix ns), and by whom (16 bytes)."""
    return ATTACHMENT.pack(sequence, sent, 16, publisher)


class Origin(NamedTuple):
    """Where a sample comes from: the attachment's content."""

    sequence: int
    sent: int
    publisher: bytes


def read_attachment(data: bytes) -> Origin:
    """Read an attachment; raises MessageError."""
    try:
        sequence, sent, size, publisher = ATTACHMENT.unpack(data)
    except error:
        raise MessageError(f"an attachment of {len(data)} bytes, not {ATTACHMENT.size}") from None
    if size != 16 or sequence < 0:
        raise MessageError("an attachment of another form")
    return Origin(sequence, sent, publisher)


class Received(NamedTuple):
    """A message that passed."""

    message: Message
    origin: Origin
    missed: int  # messages of the same publisher between the last one and this


class Inbox:
    """Receives one key. `rejected` counts the messages turned away, by reason."""

    def __init__(self, key: Key, row: Row) -> None:
        self.key = key
        self.rejected: Counter[str] = Counter()
        self._row = row
        self._newest = 0
        self._publisher = b""
        self._sequence = -1

    def accept(self, payload: bytes, attached: bytes, now: int) -> Received | None:
        """Return the message, or None when it is malformed, not newer than the last accepted, too old or ahead."""
        try:
            message, origin = self._row.message.decode(payload), read_attachment(attached)
        except MessageError:
            self.rejected["canary" if payload.startswith(CANARY) else "malformed"] += 1
            return None
        if self._newest > now + AHEAD:  # this machine's clock was set back
            self._newest = 0
        known = origin.publisher == self._publisher
        reason = self._staleness(message.stamp, known and origin.sequence <= self._sequence, now)
        if reason:
            self.rejected[reason] += 1
            return None
        missed = min(origin.sequence - self._sequence - 1, MOST_MISSED) if known else 0
        self._newest, self._publisher, self._sequence = message.stamp, origin.publisher, origin.sequence
        return Received(message, origin, missed)

    def _staleness(self, stamp: int, repeated: bool, now: int) -> str:
        if repeated:
            return "repeated"
        if stamp < self._newest:
            return "older than the last"
        if stamp > now + AHEAD:
            return "ahead of time"
        if self._row.lifetime is not None and stamp < now - self._row.lifetime * BILLION:
            return "expired"
        return ""
