"""Reads an MCAP file record by record, while the records are complete, and the messages of a swarm in it."""

from __future__ import annotations

import contextlib
import struct
import zlib
from collections.abc import Hashable, Iterable, Iterator
from io import BytesIO
from pathlib import Path
from typing import BinaryIO

import zstandard
from flockwire_core.swarm.reading import stat_file
from flockwire_core.wire import codec as wire
from flockwire_core.wire.cdr import MessageError
from flockwire_core.wire.keys import ROWS, Key
from flockwire_core.wire.plan import Plan
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, McapRecord, Message, Metadata
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap.writer import MCAP0_MAGIC

from flockwire_recorder.trace import COUNT_BITS, PUBLISHER

_HEAD = struct.Struct("<BQ")  # opcode, length of what follows
_READ = (  # what is not read tells of the others
    Opcode.HEADER, Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE, Opcode.CHUNK, Opcode.ATTACHMENT, Opcode.METADATA,
)  # fmt: skip
RETIRED = "/bids"  # topics of earlier traces: statuses tell the same
LARGEST_CHUNK = 64 << 20  # bytes without compression: a small file may claim any size
_DAMAGE = (McapError, ValueError, OverflowError, struct.error, zlib.error, zstandard.ZstdError)


class WholeRecords:
    """Iterates over the records of the MCAP file `path`, those in chunks included, up to the end of the data section.

    A file that was not closed ends after its last complete record; a damaged chunk is skipped. After the iteration,
    `closed` is whether the data section has its end, and `lost_bytes` the number of its unreadable bytes. Raises
    ValueError for a file that is not MCAP, OSError for one that cannot be read, as a pipe.
    """

    def __init__(self, path: Path) -> None:
        self.closed = False
        self.lost_bytes = 0
        self.path = path

    def __iter__(self) -> Iterator[McapRecord]:
        size = stat_file(self.path).st_size
        with self.path.open("rb") as stream:
            if stream.read(len(MCAP0_MAGIC)) != MCAP0_MAGIC:
                raise ValueError(f"{self.path}: is not an MCAP file")
            self.closed, self.lost_bytes = False, 0
            yield from self._records(stream, size)

    def _records(self, stream: BinaryIO, size: int) -> Iterator[McapRecord]:
        while size - stream.tell() >= _HEAD.size:
            begin = stream.tell()
            head = stream.read(_HEAD.size)
            opcode, length = _HEAD.unpack(head)
            if opcode == 0 or length > size - stream.tell():
                self.lost_bytes += size - begin
                return
            record = head + stream.read(length)
            if opcode in (Opcode.DATA_END, Opcode.FOOTER):
                self.closed = True
                return
            try:
                yield from _parsed(record)
            except _DAMAGE:
                self.lost_bytes += len(record)
        self.lost_bytes += size - stream.tell()


def _parsed(record: bytes) -> list[McapRecord]:
    if record[0] not in _READ:
        return []
    found = next(StreamReader(BytesIO(record), skip_magic=True, emit_chunks=True).records)
    return breakup_chunk(_inflated(found), validate_crc=True) if isinstance(found, Chunk) else [found]


def _inflated(chunk: Chunk) -> Chunk:
    """Return a chunk without compression. Raises ValueError or ZstdError for one that is larger than it may be."""
    if chunk.compression not in ("", "zstd"):
        raise ValueError(chunk.compression)
    if chunk.compression:
        with zstandard.ZstdDecompressor().stream_reader(chunk.data) as stream:
            chunk.data = stream.read(LARGEST_CHUNK + 1)
    if len(chunk.data) > LARGEST_CHUNK:
        raise ValueError(LARGEST_CHUNK)
    chunk.compression = ""
    return chunk


def publisher_of(record: Metadata) -> tuple[str, int, str] | None:
    """Return topic, number and id that `trace.about_publisher` wrote, None for another record."""
    try:
        about = record.metadata
        return (about["topic"], int(about["number"]), about["id"]) if record.name == PUBLISHER else None
    except (KeyError, ValueError):
        return None


def messages(
    plan: Plan, records: Iterable[McapRecord]
) -> Iterator[tuple[Key | None, wire.Message | None, Hashable, Message]]:
    """Yield each message of a part of a trace: key (None for an unknown topic), message, publisher, and its record.

    The message is None if it cannot be read.
    """
    keys = {f"/{plan.text(key)}": key for key in plan.keys}
    topics: dict[int, str] = {}
    publishers: dict[tuple[str, int], Hashable] = {}  # by topic and number
    for record in records:
        match record:
            case Message() if record.channel_id in topics:
                topic, number = topics[record.channel_id], record.sequence >> COUNT_BITS
                key, message = keys.get(topic), None
                if key is None and plan.swarm.auctioned and topic.endswith(RETIRED):
                    continue
                if key is not None:
                    with contextlib.suppress(MessageError):
                        message = wire.decode(ROWS[key.kind].message, record.data)
                yield key, message, (topic, publishers.get((topic, number), number)), record
            case Channel():
                topics.setdefault(record.id, record.topic)
            case Metadata() if (read := publisher_of(record)) is not None:
                topic, number, identity = read
                publishers.setdefault((topic, number), identity)
