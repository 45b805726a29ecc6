"""Repairs a trace that its recorder could not close."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from flockwire_core.trace_files import parts
from mcap.records import Attachment, Channel, Header, McapRecord, Message, Metadata, Schema
from mcap.writer import CompressionType, Writer

from flockwire_recorder.records import WholeRecords, publisher_of
from flockwire_recorder.trace import COUNT_BITS, METADATA, PUBLISHER, about_publisher


def recover(trace: Path, out: Path) -> int:
    """Copy every complete record of the MCAP file `trace` and its further parts to the new file `out`, with an index.

    Returns the number of messages. Payloads, times, sequence numbers, schemas, channels and the first part's metadata
    are kept. Raises ValueError when `trace` is no MCAP file or `out` is the same file, OSError when one cannot be read
    or written.
    """
    if out.exists() and out.samefile(trace):
        raise ValueError(f"{out}: is the trace itself; recover into another file")
    first_part, *others = map(WholeRecords, parts(trace))
    walk = iter(first_part)
    first = next(walk, None)
    with out.open("wb") as stream:
        writer = Writer(stream, compression=CompressionType.ZSTD)
        header = first if isinstance(first, Header) else Header("", "")
        writer.start(header.profile, header.library)
        numbers: dict[str, dict[str, int]] = {}
        messages = _copy(writer, walk, numbers)
        for records in others:  # the metadata are those of the first part
            rest = (one for one in records if not (isinstance(one, Metadata) and one.name == METADATA))
            messages += _copy(writer, rest, numbers)
        writer.finish()  # type: ignore[no-untyped-call]
    return messages


def _copy(writer: Writer, records: Iterator[McapRecord], numbers: dict[str, dict[str, int]]) -> int:
    """Copy one part to a writer, which renumbers schemas and channels; returns the number of messages.

    A message whose channel was lost is lost with it. Each part numbers the publishers of a topic by itself: `numbers`
    are those of the copy, by topic, then by id.
    """
    messages, schemas, channels, topics = 0, {0: 0}, dict[int, int](), dict[int, str]()
    renumbered: dict[tuple[str, int], int] = {}
    for record in records:
        match record:
            case Message(channel_id=old) if old in channels:
                number, count = divmod(record.sequence, 1 << COUNT_BITS)
                sequence = renumbered.get((topics[old], number), number) << COUNT_BITS | count
                writer.add_message(channels[old], record.log_time, record.data, record.publish_time, sequence)
                messages += 1
            case Schema() if record.id not in schemas:
                schemas[record.id] = writer.register_schema(record.name, record.encoding, record.data)
            case Channel() if record.id not in channels and record.schema_id in schemas:
                topics[record.id] = record.topic
                channels[record.id] = writer.register_channel(
                    record.topic, record.message_encoding, schemas[record.schema_id], record.metadata
                )
            case Metadata() if (read := publisher_of(record)) is not None:
                topic, number, identity = read
                known = numbers.setdefault(topic, {})
                if identity not in known:
                    known[identity] = len(known)
                    writer.add_metadata(PUBLISHER, about_publisher(topic, known[identity], identity))
                renumbered[topic, number] = known[identity]
            case Metadata():
                writer.add_metadata(record.name, record.metadata)
            case Attachment():
                writer.add_attachment(record.create_time, record.log_time, record.name, record.media_type, record.data)
    return messages
