"""Reads a trace, complete or truncated, into numpy arrays."""

from __future__ import annotations

import contextlib
from collections.abc import Hashable
from pathlib import Path

from flockwire.loading import problems
from flockwire.swarm.model import Swarm
from flockwire.wire.cdr import MessageError
from flockwire.wire.codec import decode
from flockwire.wire.keys import ROWS, Key
from flockwire_recorder.parts import parts
from flockwire_recorder.records import WholeRecords
from flockwire_recorder.trace import METADATA, PUBLISHER
from mcap.records import Channel, Metadata
from mcap.records import Message as Record

from flockwire_analysis.collecting import Collector
from flockwire_analysis.recorded import Trace


def read_trace(path: Path) -> Trace:
    """Read the trace `path` with its other parts; truncated and malformed data is counted, not raised.

    Raises ValueError for a file that is not MCAP or does not start with a swarm, or a part of another swarm; OSError if
    one cannot be read.
    """
    collector: Collector | None = None
    files = [WholeRecords(part) for part in parts(path)]
    for records in files:
        collector = _read(records, collector)
    if collector is None:
        raise ValueError(f"{path}: has no swarm: it is from another program, or was truncated at its start")
    closed, lost_bytes = all(records.closed for records in files), sum(records.lost_bytes for records in files)
    return collector.trace(path, closed, lost_bytes)


def _read(records: WholeRecords, collector: Collector | None) -> Collector | None:
    """Read one part into `collector`, or into a new one; a part without a swarm is empty."""
    reader: _Reader | None = None
    for record in records:
        if reader is not None:
            reader.take(record)
        elif isinstance(record, Metadata) and record.name == METADATA:
            swarm = _swarm(records.path, record.metadata)
            if collector is not None and swarm != collector.plan.swarm:
                raise ValueError(f"{records.path}: is from another swarm than the earlier parts of the trace")
            reader = _Reader(collector or Collector(swarm, record.metadata))
    return reader.collector if reader is not None else collector


def _swarm(path: Path, metadata: dict[str, str]) -> Swarm:
    try:
        swarm = Swarm.model_validate_json(metadata["swarm"])
    except (KeyError, ValueError) as error:
        raise ValueError(f"{path}: its swarm is from another version of flockwire: {error}") from error
    problem = next(problems(swarm, to_fly=False), None)
    if problem is not None:
        raise ValueError(f"{path}: its swarm is from another version of flockwire: {problem}")
    return swarm


class _Reader:
    """Sorts the records of a trace."""

    def __init__(self, collector: Collector) -> None:
        self.collector = collector
        plan = collector.plan
        self._keys = {f"/{plan.text(key)}": key for key in plan.keys}
        self._channels: dict[int, tuple[Key | None, Hashable]] = {}

    def take(self, record: object) -> None:
        """Receive the next record; other records than channels and messages are ignored."""
        match record:
            case Record() if record.channel_id in self._channels:
                (key, publisher), message = self._channels[record.channel_id], None
                if key is not None:
                    with contextlib.suppress(MessageError):
                        message = decode(ROWS[key.kind].message, record.data)
                self.collector.add(publisher, key, message, record.sequence, record.publish_time, record.log_time)
            case Channel(metadata=metadata) if PUBLISHER in metadata:  # the same in every part
                publisher = (record.topic, metadata[PUBLISHER])
                self._channels.setdefault(record.id, (self._keys.get(record.topic), publisher))
