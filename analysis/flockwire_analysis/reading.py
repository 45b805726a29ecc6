"""Reads a trace, complete or truncated, into numpy arrays."""

from __future__ import annotations

from pathlib import Path

from flockwire_core.loading import problems
from flockwire_core.swarm.model import Swarm
from flockwire_core.trace_files import parts
from flockwire_recorder.records import WholeRecords, messages
from flockwire_recorder.trace import COUNT_MASK, METADATA
from mcap.records import Metadata

from flockwire_analysis.collecting import Collector
from flockwire_analysis.recorded import Trace


def read_trace(path: str | Path) -> Trace:
    """Read the trace `path` with its other parts; truncated and malformed data is counted, not raised.

    Raises ValueError for a file that is not MCAP or does not start with a swarm, or a part of another swarm; OSError if
    one cannot be read.
    """
    path = Path(path)
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
    walk = iter(records)
    described = next((one for one in walk if isinstance(one, Metadata) and one.name == METADATA), None)
    if described is None:
        return collector
    swarm = _swarm(records.path, described.metadata)
    if collector is not None and swarm != collector.plan.swarm:
        raise ValueError(f"{records.path}: is from another swarm than the earlier parts of the trace")
    collector = collector or Collector(swarm, described.metadata)
    for key, message, publisher, record in messages(collector.plan, walk):
        count = record.sequence & COUNT_MASK
        collector.add(publisher, key, message, count, record.publish_time, record.log_time, len(record.data))
    return collector


def _swarm(path: Path, metadata: dict[str, str]) -> Swarm:
    try:
        swarm = Swarm.model_validate_json(metadata["swarm"])
        if found := problems(swarm, to_fly=False):
            raise ValueError(found[0])
    except (KeyError, ValueError) as error:
        raise ValueError(f"{path}: its swarm is from another version of flockwire: {error}") from error
    return swarm
