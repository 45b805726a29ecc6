"""Repairs a trace that its recorder could not close."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from mcap.records import Attachment, Channel, Header, McapRecord, Message, Metadata, Schema
from mcap.writer import CompressionType, Writer

from flockwire_recorder.parts import parts
from flockwire_recorder.records import WholeRecords


@dataclass(frozen=True, slots=True)
class Recovered:
    """The result of `recover`: `messages` copied, `lost_bytes`, and whether the trace was `closed`."""

    messages: int
    lost_bytes: int
    closed: bool


def recover(trace: Path, out: Path) -> Recovered:
    """Copy every complete record of the MCAP file `trace` and its further parts to the new file `out`, with an index.

    Payloads, times, sequence numbers, schemas, channels and the first part's metadata are kept. Raises ValueError when
    `trace` is no MCAP file or `out` is the same file, OSError when one cannot be read or written.
    """
    if out.exists() and out.samefile(trace):
        raise ValueError(f"{out}: is the trace itself; recover into another file")
    files = [WholeRecords(part) for part in parts(trace)]
    walk = iter(files[0])
    first = next(walk, None)
    with out.open("wb") as stream:
        writer = Writer(stream, compression=CompressionType.ZSTD)
        header = first if isinstance(first, Header) else Header("", "")
        writer.start(header.profile, header.library)
        messages = _copy(writer, walk) + sum(
            _copy(writer, (record for record in records if not isinstance(record, Metadata))) for records in files[1:]
        )  # the metadata are those of the first part
        writer.finish()  # type: ignore[no-untyped-call]
    return Recovered(messages, sum(records.lost_bytes for records in files), all(records.closed for records in files))


def _copy(writer: Writer, records: Iterator[McapRecord]) -> int:
    """Copy one part; returns the number of messages."""
    copier = _Copier(writer)
    for record in records:
        copier.copy(record)
    return copier.messages


class _Copier:
    """Passes records to a writer, which renumbers schemas and channels."""

    def __init__(self, writer: Writer) -> None:
        self.messages = 0
        self._writer = writer
        self._schemas = {0: 0}
        self._channels: dict[int, int] = {}

    def copy(self, record: McapRecord) -> None:
        """Write one record; a message whose channel was lost is lost with it."""
        match record:
            case Message(channel_id=old) if old in self._channels:
                self._writer.add_message(
                    self._channels[old], record.log_time, record.data, record.publish_time, record.sequence
                )
                self.messages += 1
            case Schema() if record.id not in self._schemas:
                self._schemas[record.id] = self._writer.register_schema(record.name, record.encoding, record.data)
            case Channel() if record.id not in self._channels and record.schema_id in self._schemas:
                self._channels[record.id] = self._writer.register_channel(
                    record.topic, record.message_encoding, self._schemas[record.schema_id], record.metadata
                )
            case Metadata():
                self._writer.add_metadata(record.name, record.metadata)
            case Attachment():
                self._writer.add_attachment(
                    record.create_time, record.log_time, record.name, record.media_type, record.data
                )
