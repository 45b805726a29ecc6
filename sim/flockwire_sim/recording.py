"""Records a virtual flight: a trace on disk or in memory."""

from __future__ import annotations

from pathlib import Path

from flockwire.process.faults import Fault
from flockwire.swarm.model import Swarm
from flockwire.wire.schemas import ROS_TYPES
from flockwire_analysis.collecting import Collector
from flockwire_analysis.recorded import Trace
from flockwire_recorder.trace import TraceWriter, describe

from flockwire_sim.process import Published
from flockwire_sim.world import EPOCH


class TraceFile:
    """Writes the trace `path`, equal bytes for equal flights. Raises OSError if the disk fails."""

    def __init__(self, path: Path, swarm: Swarm, toml: str, seed: int, faults: tuple[Fault, ...] = ()) -> None:
        self._writer = TraceWriter(path, describe(swarm, toml, seed, EPOCH, faults, virtual=True))

    def take(self, published: Published) -> None:
        """Write one message."""
        sample = published.sample
        self._writer.write(
            published.topic,
            ROS_TYPES[sample.row.message],
            published.publisher,
            published.sequence,
            published.at,
            published.sent,
            sample.payload,
        )

    def close(self) -> None:
        """End the file."""
        self._writer.close()


class TraceInMemory:
    """Collects published messages into a trace without a file."""

    def __init__(self, swarm: Swarm, seed: int, faults: tuple[Fault, ...] = ()) -> None:
        self._collector = Collector(swarm, describe(swarm, "", seed, EPOCH, faults, virtual=True))

    def take(self, published: Published) -> None:
        """Collect one message."""
        opened = published.sample.opened()
        message = opened[0] if opened is not None else None
        self._collector.add(
            (published.publisher, published.key),
            published.key,
            message,
            published.sequence,
            published.sent,
            published.at,
        )

    def trace(self) -> Trace:
        """Return the trace so far."""
        return self._collector.trace(Path("memory"))
