"""Reads an MCAP file record by record, while the records are complete."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import BinaryIO

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, Header, McapRecord, Message, Metadata, Schema
from mcap.stream_reader import breakup_chunk
from mcap.writer import MCAP0_MAGIC

_HEAD = struct.Struct("<BQ")  # opcode, length of what follows
_READERS = {
    Opcode.HEADER: Header.read,
    Opcode.SCHEMA: Schema.read,
    Opcode.CHANNEL: Channel.read,
    Opcode.CHUNK: Chunk.read,
    Opcode.ATTACHMENT: Attachment.read,
    Opcode.METADATA: Metadata.read,
}
_DAMAGE = (McapError, ValueError, struct.error, zlib.error, zstandard.ZstdError)


class WholeRecords:
    """Iterates over the records of the MCAP file `path`, those in chunks included, up to the end of the data section.

    A file that was not closed ends after its last complete record; a damaged chunk is skipped. After the iteration,
    `closed` is whether the data section has its end, and `lost_bytes` the number of its unreadable bytes. Raises
    ValueError for a file that is not MCAP, OSError for one that cannot be read.
    """

    def __init__(self, path: Path) -> None:
        self.closed = False
        self.lost_bytes = 0
        self.path = path

    def __iter__(self) -> Iterator[McapRecord]:
        with self.path.open("rb") as stream:
            if stream.read(len(MCAP0_MAGIC)) != MCAP0_MAGIC:
                raise ValueError(f"{self.path}: is not an MCAP file")
            self.closed, self.lost_bytes = False, 0
            yield from self._records(stream, self.path.stat().st_size)

    def _records(self, stream: BinaryIO, size: int) -> Iterator[McapRecord]:
        while size - stream.tell() >= _HEAD.size:
            begin = stream.tell()
            opcode, length = _HEAD.unpack(stream.read(_HEAD.size))
            if opcode == 0 or length > size - stream.tell():
                self.lost_bytes += size - begin
                return
            body = stream.read(length)
            if opcode in (Opcode.DATA_END, Opcode.FOOTER):
                self.closed = True
                return
            try:
                yield from _parsed(opcode, body)
            except _DAMAGE:
                self.lost_bytes += _HEAD.size + length
        self.lost_bytes += size - stream.tell()


def _parsed(opcode: int, body: bytes) -> list[McapRecord]:
    data = ReadDataStream(BytesIO(body))
    if opcode == Opcode.MESSAGE:
        return [Message.read(data, len(body))]
    if opcode not in _READERS:
        return []
    record = _READERS[Opcode(opcode)](data)
    return breakup_chunk(record, validate_crc=True) if isinstance(record, Chunk) else [record]
