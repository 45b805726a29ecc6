"""An MCAP writer for many small messages: the records of the mcap package, with a fast path for messages.

The package's own writer takes 3.4 us for a message, this one 0.3 us compiled, 0.7 interpreted. A second of five drones
has 2500 messages: in virtual time, with a trace, it takes 7 ms, with the package's writer 15 ms. That also ends a chunk
at each flush. The file is the same. The Rust writer of foxglove-sdk (0.30) cannot replace it: it has no sequence number
or publish time, which show losses and delays.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterable
from struct import Struct, pack
from typing import Any, BinaryIO, Final

import zstandard
from librt.strings import BytesWriter, write_i16_le, write_i32_le, write_i64_le
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)
from mcap.writer import MCAP0_MAGIC

_MESSAGE: Final = int(Opcode.MESSAGE)
_HALF: Final = 1 << 31  # of unsigned numbers of 32 bits: from there on they are written as negative ones
_HALF_SHORT: Final = 1 << 15
CHUNK_SPAN: Final = 250_000_000  # ns of log time after which a flush ends a chunk
_INDEX = Struct("<BQHI")  # opcode, length, channel, bytes of entries


class ChunkedWriter:
    """Writes an MCAP file to `stream` in zstd chunks of some `chunk_size` bytes."""

    def __init__(self, stream: BinaryIO, chunk_size: int) -> None:
        self._stream, self._chunk_size = stream, chunk_size
        self._schemas: list[Schema] = []
        self._channels: list[Channel] = []
        self._counts: dict[int, int] = {}
        self._chunks: list[bytes] = []  # index of each, for the summary: some 5 KB/s
        self._metadata: list[MetadataIndex] = []
        self._begin, self._end = 0, 0  # log times of the whole file
        self._compressor = zstandard.ZstdCompressor()
        self._data = BytesWriter()  # of the current chunk, like the following
        self._index: dict[int, BytesWriter] = {}  # log time and place of each message, by channel
        self._first, self._last = 0, 0

    def start(self, profile: str, library: str) -> None:
        """Write the head of the file."""
        self._stream.write(MCAP0_MAGIC + _bytes(Header(profile, library)))

    def add_metadata(self, name: str, data: dict[str, str]) -> None:
        """Write a metadata record."""
        record = _bytes(Metadata(name=name, metadata=data))
        self._metadata.append(MetadataIndex(offset=self._stream.tell(), length=len(record), name=name))
        self._stream.write(record)

    def register_schema(self, name: str, encoding: str, data: bytes) -> int:
        """Add a schema; returns its id."""
        self._schemas.append(Schema(id=len(self._schemas) + 1, data=data, encoding=encoding, name=name))
        self._data.write(_bytes(self._schemas[-1]))
        return len(self._schemas)

    def register_channel(self, topic: str, encoding: str, schema: int, metadata: dict[str, str]) -> int:
        """Add a channel; returns its id."""
        number = len(self._channels) + 1
        self._channels.append(
            Channel(id=number, topic=topic, message_encoding=encoding, schema_id=schema, metadata=metadata)
        )
        self._data.write(_bytes(self._channels[-1]))
        return number

    def add_message(self, channel: int, log_time: int, data: bytes, publish_time: int, sequence: int) -> None:
        """Append a message to the chunk."""
        index, chunk = self._index.get(channel), self._data
        if index is None:
            index = self._index[channel] = BytesWriter()
        write_i64_le(index, log_time)
        write_i64_le(index, len(chunk))
        chunk.append(_MESSAGE)
        write_i64_le(chunk, 22 + len(data))  # bytes of a message record before its data
        write_i16_le(chunk, channel if channel < _HALF_SHORT else channel - 2 * _HALF_SHORT)
        write_i32_le(chunk, sequence if sequence < _HALF else sequence - 2 * _HALF)
        write_i64_le(chunk, log_time)
        write_i64_le(chunk, publish_time)
        chunk.write(data)
        if not self._first or log_time < self._first:
            self._first = log_time
        self._last = max(self._last, log_time)
        if len(chunk) > self._chunk_size:
            self._end_chunk()

    def flush(self) -> None:
        """Pass all data to the operating system.

        A chunk that is shorter than CHUNK_SPAN is written, and written again with more in it by the next call.
        """
        if self._last - self._first >= CHUNK_SPAN:
            self._end_chunk()
        elif self._index:
            begin = self._stream.tell()
            self._stream.write(self._chunk(begin)[0])
            self._stream.seek(begin)
        self._stream.flush()

    def finish(self) -> None:
        """Write what is buffered and the summary section."""
        self._end_chunk()
        self._stream.write(_bytes(DataEnd(0)))
        start = at = self._stream.tell()
        crc, offsets = 0, bytearray()
        for opcode, blocks in self._summary():
            begin = at
            for block in blocks:
                self._stream.write(block)
                crc, at = zlib.crc32(block, crc), at + len(block)
            offsets += _bytes(SummaryOffset(group_opcode=opcode, group_start=begin, group_length=at - begin))
        crc = zlib.crc32(pack("<BQQQ", Opcode.FOOTER, 20, start, at), zlib.crc32(offsets, crc))
        footer = _bytes(Footer(summary_start=start, summary_offset_start=at, summary_crc=crc))
        self._stream.write(bytes(offsets) + footer + MCAP0_MAGIC)
        self._stream.truncate()

    def _summary(self) -> list[tuple[Opcode, Iterable[bytes]]]:
        """Return the groups of the summary, each as records."""
        statistics = Statistics(
            attachment_count=0,
            channel_count=len(self._channels),
            channel_message_counts=dict(sorted(self._counts.items())),
            chunk_count=len(self._chunks),
            message_count=sum(self._counts.values()),
            metadata_count=len(self._metadata),
            message_start_time=self._begin,
            message_end_time=self._end,
            schema_count=len(self._schemas),
        )
        return [
            (Opcode.SCHEMA, map(_bytes, self._schemas)),
            (Opcode.CHANNEL, map(_bytes, self._channels)),
            (Opcode.STATISTICS, [_bytes(statistics)]),
            (Opcode.CHUNK_INDEX, self._chunks),
            (Opcode.METADATA_INDEX, map(_bytes, self._metadata)),
        ]

    def _end_chunk(self) -> None:
        if not self._index:
            return
        written, chunk = self._chunk(self._stream.tell())
        self._stream.write(written)
        self._chunks.append(_bytes(chunk))
        for channel, entries in self._index.items():
            self._counts[channel] = self._counts.get(channel, 0) + len(entries) // 16  # bytes of an entry
        first, last = self._first, self._last
        self._begin, self._end = min(self._begin or first, first), max(self._end, last)
        self._data, self._index, self._first, self._last = BytesWriter(), {}, 0, 0

    def _chunk(self, begin: int) -> tuple[bytes, ChunkIndex]:
        """Return the chunk so far with the indexes of its messages, as bytes at `begin` of the file, and its index."""
        data, first, last = self._data.getvalue(), self._first, self._last
        compressed = self._compressor.compress(data)
        record = _bytes(
            Chunk(
                compression="zstd", data=compressed, message_start_time=first, message_end_time=last,
                uncompressed_crc=zlib.crc32(data), uncompressed_size=len(data),
            )
        )  # fmt: skip
        indexes, offsets = bytearray(), {}
        for channel, entries in self._index.items():
            offsets[channel] = begin + len(record) + len(indexes)
            size = len(entries)
            indexes += _INDEX.pack(Opcode.MESSAGE_INDEX, 6 + size, channel, size) + entries.getvalue()
        chunk = ChunkIndex(
            message_start_time=first, message_end_time=last, chunk_start_offset=begin, chunk_length=len(record),
            message_index_offsets=offsets, message_index_length=len(indexes), compression="zstd",
            compressed_size=len(compressed), uncompressed_size=len(data),
        )  # fmt: skip
        return record + indexes, chunk


def _bytes(record: McapRecord) -> bytes:
    builder: Any = RecordBuilder()  # without types, and not what its `end` declares
    record.write(builder)
    return bytes(builder.end())
