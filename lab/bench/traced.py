"""What was published, by a trace alone: all that the scripts beside this one judge by."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from flockwire_recorder.records import WholeRecords
from mcap.records import Channel, Message


def published(trace: Path, *kinds: str) -> Iterator[tuple[str, str, Message]]:
    """Yield owner, kind and record of all that was published of `kinds`. Raises OSError, ValueError."""
    owned: dict[int, tuple[str, str]] = {}
    for record in WholeRecords(trace):
        match record:
            case Channel(topic=topic) if topic.count("/") == 3:
                _, _, owner, kind = topic.split("/")
                if kind in kinds:
                    owned[record.id] = owner, kind
            case Message() if record.channel_id in owned:
                yield *owned[record.channel_id], record
