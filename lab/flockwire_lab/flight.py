"""A whole flight in virtual time, into a trace on disk or in memory."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import NamedTuple

from flockwire_analysis.collecting import Collector
from flockwire_analysis.recorded import Trace
from flockwire_core.domain.time import SECOND
from flockwire_core.swarm.model import Swarm
from flockwire_core.wire.schemas import ROS_TYPES
from flockwire_recorder.trace import TraceWriter, describe

from flockwire_lab.faults.file import notes
from flockwire_lab.faults.kinds import Fault
from flockwire_lab.process import Published, Tap
from flockwire_lab.world import EPOCH, Outcome, World

Show = Callable[[float], object]  # is called at each virtual second with the s flown so far


class TraceFile(TraceWriter):
    """Writes the trace `path`, equal bytes for equal flights. Raises OSError if the disk fails."""

    def __init__(self, path: Path, swarm: Swarm, toml: str, seed: int, faults: tuple[Fault, ...] = ()) -> None:
        super().__init__(path, describe(swarm, toml, seed, EPOCH, notes(faults), virtual=True))

    def take(self, published: Published) -> None:
        """Write one message."""
        sample = published.sample
        self.write(
            published.topic, ROS_TYPES[sample.row.message], sample.publisher, sample.sequence, published.at,
            sample.sent, sample.payload,
        )  # fmt: skip


class TraceInMemory:
    """Collects published messages into a trace without a file."""

    def __init__(self, swarm: Swarm, seed: int, faults: tuple[Fault, ...] = ()) -> None:
        self._collector = Collector(swarm, describe(swarm, "", seed, EPOCH, notes(faults), virtual=True))

    def take(self, published: Published) -> None:
        """Collect one message."""
        sample = published.sample
        self._collector.add(
            sample.publisher, published.key, sample.message(), sample.sequence, sample.sent, published.at,
            len(sample.payload),
        )  # fmt: skip

    def trace(self) -> Trace:
        """Return the trace so far."""
        return self._collector.trace(Path("memory"))


class Flight(NamedTuple):
    """What to fly: `duration` s from take-off to landing, by `seed`, the drones `without` staying on the ground."""

    swarm: Swarm
    seed: int
    duration: float
    faults: tuple[Fault, ...] = ()
    without: tuple[int, ...] = ()


def fly_recorded(flight: Flight, toml: str, path: Path, show: Show) -> Outcome:
    """Fly, and write the trace `path`, which holds the swarm file's text `toml`. Raises OSError."""
    # Closed, the trace of an interrupted flight can be read, too.
    with closing(TraceFile(path, flight.swarm, toml, flight.seed, flight.faults)) as trace:
        return _fly(flight, trace.take, show)


def fly_in_memory(flight: Flight, show: Show) -> tuple[Outcome, Trace]:
    """Fly, and return the trace without writing anything."""
    trace = TraceInMemory(flight.swarm, flight.seed, flight.faults)
    outcome = _fly(flight, trace.take, show)
    return outcome, trace.trace()


def _fly(flight: Flight, tap: Tap, show: Show) -> Outcome:
    world = World(flight.swarm, flight.seed, flight.duration, flight.faults, tap, flight.without)
    scheduler = world.scheduler

    def tick(_: object) -> None:
        show((scheduler.now - EPOCH) / SECOND)
        scheduler.at(scheduler.now + SECOND, tick)

    scheduler.at(scheduler.now + SECOND, tick)
    return world.run()
