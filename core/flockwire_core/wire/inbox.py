"""Checks every received message: decodes it, judges its freshness, counts rejections."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Iterable
from struct import Struct, error
from typing import Final, NamedTuple
from zlib import crc32

from flockwire_core.domain.order import Mission
from flockwire_core.domain.time import SECOND
from flockwire_core.wire.cdr import MessageError
from flockwire_core.wire.codec import CODECS, Message
from flockwire_core.wire.keys import ANY_TIME, ROWS, Key
from flockwire_core.wire.status import Counts

ATTACHMENT: Final = Struct("<qqB16s")  # as rmw_zenoh: sequence number, source time in ns, 16, publisher id
CANARY: Final = b"flockwire canary"  # published by the conformance probe instead of a message: dropped and counted
MISDIRECTED: Final = "of another key"  # reason for a message that was published on another key
OVER_QUOTA: Final = "over quota"  # reason for a message that is too large, or one too many
MOST_MISSED: Final = 1_000_000  # a larger gap is forged, and must not overflow a counter
BURST: Final = 4  # s of its quota that a key may use at once, as after a receiver was frozen


def publisher_of(session: bytes, key: Key) -> bytes:
    """Return the 16 bytes that identify the publisher of `key` in a session, from 12 of the session's.

    The last four are the key's: Zenoh names keys by numbers of a link, and just after a link was made again it may
    deliver a sample under another key of the same link (seen with 1.10.2).
    """
    return session[:12] + mark_of(key)


def mark_of(key: Key) -> bytes:
    """Return the last four bytes of a publisher of `key`."""
    return crc32(f"{key.owner}/{key.kind}".encode()).to_bytes(4, "big")


def attachment(sequence: int, sent: int, session: bytes, key: Key) -> bytes:
    """Return the attachment of a sample: its number, send time (Unix ns), and publisher."""
    return ATTACHMENT.pack(sequence, sent, 16, publisher_of(session, key))


class Origin(NamedTuple):
    """The origin of a sample: the attachment's content."""

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


class Quota:
    """The quota of a key: `rate` messages per s, and at most BURST s of that at once.

    A token bucket kept as one time, its theoretical arrival time (ITU-T I.371, GCRA): each message moves it on by
    1 / rate, and one that finds it BURST ahead of the present exceeds the quota.
    """

    def __init__(self, rate: int) -> None:
        self._spacing = SECOND // rate
        self._arrival = 0

    def exceeded(self, now: int) -> bool:
        """Return whether a message received at `now` (Unix ns) exceeds the quota; count it if it does not."""
        arrival = self._arrival
        if arrival < now or arrival > now + 2 * BURST * SECOND:  # nothing is used up, or the clock was set back
            arrival = now
        elif arrival > now + BURST * SECOND:
            return True
        self._arrival = arrival + self._spacing
        return False


class Inbox:
    """Receives one key.

    `rejected` counts rejected messages by reason. For the last accepted one, `sent` is its send time (Unix ns),
    `missed` the number of missing messages of the same publisher before it.
    """

    def __init__(self, key: Key) -> None:
        self.key, row = key, ROWS[key.kind]
        self.rejected: Counter[str] = Counter()
        self.sent = self.missed = 0
        self.ahead = 0  # ns by which the receiver's time is ahead of swarm time (process/stepping.py)
        self._decode, self._mark = CODECS[row.message].decode, mark_of(key)
        self._maximum_age = None if row.maximum_age is None else round(row.maximum_age * SECOND)
        self._ahead, self._any_time = round(row.max_future * SECOND), row.max_future >= ANY_TIME
        self._newest = 0
        self._publisher = b""  # of the last message, and its sequence number
        self._sequence = -1
        self._sequences: dict[bytes, int] = {}  # the last one of each publisher before it
        self._quota, self._largest = Quota(row.rate), row.largest
        self.keep_all = row.keep_all

    def accept(self, payload: bytes, attached: bytes, now: int) -> Message | None:
        """Return the message, or None if it is malformed, not newer than the last accepted, too old or ahead.

        A message over the key's quota (KeyRow) is not decoded.
        """
        if len(payload) > self._largest or self._quota.exceeded(now):
            return self._reject(OVER_QUOTA)
        if payload.startswith(CANARY):
            return self._reject("canary")
        try:
            message: Message = self._decode(payload)
            sequence, sent, size, publisher = ATTACHMENT.unpack(attached)
        except (MessageError, error):
            return self._reject("malformed")
        return self.admit(message if size == 16 and sequence >= 0 else None, sequence, sent, publisher, now)

    def admit(self, message: Message | None, sequence: int, sent: int, publisher: bytes, now: int) -> Message | None:
        """Judge the `sequence`-th message of `publisher` (None: malformed) as `accept` does; return one that passes."""
        if message is None:
            return self._reject("malformed")
        if self.ahead:
            message = shifted(message, self.ahead)
        if self._newest > now + self._ahead:  # swarm time was set back, and whoever reads has no time of its own
            self._newest = 0
        stamp, same = message.stamp, publisher == self._publisher
        last = self._sequence if same else self._sequences.get(publisher, sequence - 1)
        missed = sequence - last - 1
        reason = ""
        if missed < 0:
            reason = "repeated"
        elif not same and not publisher.endswith(self._mark):
            reason = MISDIRECTED
        elif stamp < self._newest and not self._any_time:  # its sequence number shows repetitions
            reason = "older than the last"
        elif stamp > now + self._ahead:
            reason = "ahead of time"
        elif self._maximum_age is not None and stamp < now - self._maximum_age:
            reason = "expired"
        if reason:
            return self._reject(reason)
        self.missed = min(missed, MOST_MISSED)
        self.sent, self._newest = sent, stamp
        if not same:
            self._change(publisher)
        self._sequence = sequence
        return message

    def _change(self, publisher: bytes) -> None:
        """Keep the last sequence number of the publisher before `publisher`."""
        self._sequences[self._publisher] = self._sequence
        self._publisher = publisher
        if len(self._sequences) > 64:  # publishers of a key whose last sequence numbers are kept
            del self._sequences[next(iter(self._sequences))]

    def _reject(self, reason: str) -> Message | None:
        self.rejected[reason] += 1
        return None


def shifted(message: Message, by: int) -> Message:
    """Return `message` with its times moved by `by` ns."""
    if isinstance(message, Mission):
        return message.shift(by)
    moved: Message = message._replace(stamp=message.stamp + by)  # type: ignore[attr-defined]
    return moved


def rejections(named: Iterable[tuple[str, Inbox]]) -> Counts:
    """Return the counts of rejected messages of inboxes, each with its key as text, by key and reason."""
    return tuple(
        [
            (f"{name} {reason}", count)
            for name, inbox in named
            if inbox.rejected
            for reason, count in inbox.rejected.items()
        ]
    )


class Input(ABC):
    """The newest sample of the key of `inbox`, until it is read."""

    __slots__ = ("inbox",)

    def __init__(self, inbox: Inbox) -> None:
        self.inbox: Final = inbox

    @abstractmethod
    def message(self, now: int) -> Message | None:
        """Return the newest message that came since the last call and was accepted, None when there is none."""
