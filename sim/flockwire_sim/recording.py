"""What becomes of all that is said in a virtual flight: a trace on disk, or one in memory."""

from __future__ import annotations

from pathlib import Path

from flockwire.config import Swarm
from flockwire.schemas import ROS_TYPES
from flockwire_recorder.reading import Collector, Trace
from flockwire_recorder.trace import TraceWriter, describe_virtual

from flockwire_sim.process import Said
from flockwire_sim.world import EPOCH


class TraceFile:
    """Writes the trace `path`, the same bytes for the same flight. Raises OSError where the disk does not take it."""

    def __init__(self, path: Path, swarm: Swarm, toml: str, seed: int) -> None:
        self._writer = TraceWriter(path, describe_virtual(swarm, toml, seed, EPOCH))

    def take(self, said: Said) -> None:
        """Write one message."""
        sample = said.sample
        self._writer.write(
            said.topic, ROS_TYPES[sample.row.message], said.publisher, said.sequence, said.at, said.sent, sample.payload
        )

    def close(self) -> None:
        """End the file."""
        self._writer.close()


class TraceInMemory:
    """Collects what is said into a trace without a file."""

    def __init__(self, swarm: Swarm, seed: int) -> None:
        self._collector = Collector(swarm, describe_virtual(swarm, "", seed, EPOCH))

    def take(self, said: Said) -> None:
        """Collect one message."""
        opened = said.sample.opened()
        message = opened[0] if opened is not None else None
        self._collector.add((said.publisher, said.key), said.key, message, said.sequence, said.sent, said.at)

    def trace(self) -> Trace:
        """Return the trace so far."""
        return self._collector.trace(Path("memory"))
