"""Batches: the messages of the control rate reach the recorder ten times a second, many in one.

Each message keeps its key, its sequence number, its send time and its bytes. If a process is killed, its messages of up
to two periods are not recorded; drones receive every message directly.
"""

from __future__ import annotations

from struct import Struct, error
from typing import Final, NamedTuple

from flockwire_core.domain.time import SECOND
from flockwire_core.wire.cdr import MessageError, Reader, Writer

PERIOD: Final = SECOND // 10  # ns from a batch's first message until it is sent
FULL: Final = 32768  # bytes from which a batch is sent at once
MOST: Final = 256  # messages of a batch; it is sent at once when it has so many
LARGEST: Final = 65000  # bytes: a full batch and the largest message
_PADDING: Final = tuple([bytes(count) for count in range(8)])
_BEFORE: Final = Struct("<QqI")  # sequence number, send time, length of the key with its NUL
_LENGTH: Final = Struct("<I")


class Entry(NamedTuple):
    """One message in a batch: its key without the swarm's name, its sequence number, its send time (Unix ns)."""

    key: str
    sequence: int
    sent: int
    payload: bytes


class Batch(NamedTuple):
    """Messages of one process, in the order of sending. Stamp: when it was sent, Unix ns."""

    stamp: int
    frame: str
    entries: tuple[Entry, ...]


class Head:
    """What stands before each payload of one key: its struct, and the key's text."""

    def __init__(self, key: str) -> None:
        self.raw = key.encode() + b"\0"
        size = len(self.raw)
        self.pack = Struct(f"<QqI{size}s{-size % 4}xI").pack


class Collecting:
    """Collects the messages of a process in world frame `frame` into its next batch, as CDR."""

    def __init__(self, frame: str) -> None:
        self._frame = frame
        self._data = bytearray()
        self._count = 0
        self._first = 0  # send time of the first message, Unix ns

    def add(self, head: Head, sequence: int, sent: int, payload: bytes) -> bool:
        """Add a message; return whether the batch is full."""
        data = self._data
        if data:
            data += _PADDING[-len(data) % 8]
        else:
            self._first = sent
        data += head.pack(sequence, sent, len(head.raw), head.raw, len(payload))
        data += payload
        self._count += 1
        return len(data) >= FULL or self._count >= MOST

    def due(self, now: int) -> bool:
        """Return whether the batch is to be sent at `now` (Unix ns)."""
        return self._count > 0 and now - self._first >= PERIOD

    @property
    def empty(self) -> bool:
        """Whether there is nothing to send."""
        return not self._count

    def take(self, now: int) -> bytes:
        """Return the batch, sent at `now` (Unix ns), and begin the next one."""
        writer = Writer()
        writer.time(now)
        writer.text(self._frame)
        writer.put("I", self._count)
        head, data = writer.finish(), bytes(self._data)
        self._data, self._count = bytearray(), 0
        return head + _PADDING[(4 - len(head)) % 8] + data if data else head


def encode_batch(batch: Batch) -> bytes:
    """Return the CDR bytes of `batch`."""
    collecting = Collecting(batch.frame)
    for key, sequence, sent, payload in batch.entries:
        collecting.add(Head(key), sequence, sent, payload)
    return collecting.take(batch.stamp)


def decode_batch(data: bytes) -> Batch:
    """Return the batch in `data`; raises MessageError."""
    reader = Reader(data)
    stamp, frame, count = reader.time(), reader.text(), reader.length()
    if count > MOST:
        raise MessageError(f"a batch of {count} messages, more than {MOST}")
    at, entries = reader.position, []
    try:
        for _ in range(count):
            at += (4 - at) % 8
            sequence, sent, length = _BEFORE.unpack_from(data, at)
            begin = at + _BEFORE.size
            at = begin + length
            key = data[begin : at - 1].decode()
            at += -at % 4
            (size,) = _LENGTH.unpack_from(data, at)
            payload = data[at + _LENGTH.size : at + _LENGTH.size + size]
            if not length or data[begin + length - 1] or len(payload) != size:
                raise MessageError(f"a message in a batch of {len(data)} bytes does not end where it should")
            at += _LENGTH.size + size
            entries.append(Entry(key, sequence, sent, payload))
    except (error, IndexError, UnicodeDecodeError):
        raise MessageError(f"a batch of {count} messages and {len(data)} bytes is not whole") from None
    if len(data) - at > 3 or any(data[at:]):
        raise MessageError(f"{len(data) - at} bytes are left over")
    return Batch(stamp, frame, tuple(entries))
