"""The short way of writing MCAP gives what the mcap package's own writer gives."""

from __future__ import annotations

import random
from pathlib import Path
from typing import Any

from flockwire_recorder.chunked import CHUNK_SPAN, ChunkedWriter
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer


def write(writer: Any) -> None:
    dice = random.Random(1)
    writer.start("ros2", "test")
    writer.add_metadata("about", {"a": "1", "b": "2"})
    schema = writer.register_schema("x/msg/Y", "ros2msg", b"float64 z")
    channels = [writer.register_channel(f"/{k}", "cdr", schema, {"publisher": str(k)}) for k in range(3)]
    for k in range(2000):
        time = 10**18 + k * CHUNK_SPAN + dice.randrange(5000)  # a flush ends a chunk, as the package's does
        writer.add_message(dice.choice(channels), time, dice.randbytes(dice.randrange(1, 200)), time - 7, k)
        if k % 700 == 699:
            writer.flush()
    writer.finish()


def test_both_writers_files_read_the_same(tmp_path: Path) -> None:
    ours, theirs = tmp_path / "ours.mcap", tmp_path / "theirs.mcap"
    with ours.open("wb") as stream:
        write(ChunkedWriter(stream, 20_000))
    with theirs.open("wb") as stream:
        write(Writer(stream, 20_000, CompressionType.ZSTD))
    read = []
    for path in (ours, theirs):
        with path.open("rb") as stream:
            reader = make_reader(stream, validate_crcs=True)
            summary = reader.get_summary()
            read.append(
                (
                    list(reader.iter_messages()),
                    list(reader.iter_messages(topics=["/1"])),
                    summary.statistics,
                    summary.channels,
                    summary.schemas,
                    summary.chunk_indexes,
                    list(reader.iter_metadata()),
                )
            )
    assert read[0] == read[1]
    assert len(read[0][0]) == 2000
