"""Batches: the messages of the control rate reach the recorder ten times a second, many in one.

A radio link that loses packets passes some 40 messages a second, and a process publishes 200 (docs/radio.md).
Each message keeps its key, its sequence number, its send time and its bytes. If a process is killed, its messages of up
to two periods are not recorded; drones receive every message directly.
"""

from __future__ import annotations

from typing import Final, NamedTuple

from flockwire_core.domain.time import SECOND
from flockwire_core.wire.cdr import MessageError, Reader, Writer

PERIOD: Final = SECOND // 10  # ns from a batch's first message until it is sent
FULL: Final = 32768  # bytes from which a batch is sent at once
MOST: Final = 256  # messages of a batch; it is sent at once when it has so many
LARGEST: Final = 65000  # bytes: a full batch and the largest message


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


class BatchBuilder:
    """Collects the messages of a process in world frame `frame` into its next batch."""

    def __init__(self, frame: str) -> None:
        self._frame = frame
        self._entries: list[Entry] = []
        self._size = 0

    def add(self, entry: Entry) -> bool:
        """Add a message; return whether the batch is full."""
        self._entries.append(entry)
        self._size += 40 + len(entry.key) + len(entry.payload)  # bytes of an entry besides its key and payload, at most
        return self._size >= FULL or len(self._entries) >= MOST

    def is_due(self, now: int) -> bool:
        """Return whether the batch is to be sent at `now` (Unix ns)."""
        return bool(self._entries) and not 0 <= now - self._entries[0].sent < PERIOD  # or swarm time was set back

    def take(self, now: int) -> Batch:
        """Return the batch, sent at `now` (Unix ns), and begin the next one."""
        batch = Batch(now, self._frame, tuple(self._entries))
        self._entries, self._size = [], 0
        return batch


def write_batch(writer: Writer, batch: Batch) -> None:
    """Append a batch's entries, after its stamp and frame."""
    writer.unsigned(len(batch.entries))
    for key, sequence, sent, payload in batch.entries:
        writer.put_all("q", sequence, sent)
        writer.text(key)
        writer.octets(payload)


def read_batch(stamp: int, frame: str, reader: Reader) -> Batch:
    """Read the output of `write_batch`; raises MessageError."""
    count, entries = reader.length(), list[Entry]()
    if count > MOST:
        raise MessageError(f"a batch of {count} messages, more than {MOST}")
    for _ in range(count):
        sequence, sent = reader.take_all("q", 2)
        entries.append(Entry(reader.text(), sequence, sent, reader.octets()))
    return Batch(stamp, frame, tuple(entries))
