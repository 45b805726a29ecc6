"""A whole flight in virtual time, into a trace on disk or in memory."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from flockwire.domain.time import SECOND
from flockwire.process.faults import Fault
from flockwire.swarm.model import Swarm
from flockwire_analysis.recorded import Trace

from flockwire_sim.process import Tap
from flockwire_sim.recording import TraceFile, TraceInMemory
from flockwire_sim.world import EPOCH, Outcome, World

Show = Callable[[float], object]  # is called at each virtual second with the s flown so far


class Flight(NamedTuple):
    """What to fly: `duration` s from take-off to landing, by `seed`, the drones `without` staying on the ground."""

    swarm: Swarm
    seed: int
    duration: float
    faults: tuple[Fault, ...] = ()
    without: tuple[int, ...] = ()


def fly_recorded(flight: Flight, toml: str, path: Path, show: Show) -> Outcome:
    """Fly, and write the trace `path`, which holds the swarm file's text `toml`. Raises OSError."""
    trace = TraceFile(path, flight.swarm, toml, flight.seed, flight.faults)
    try:
        return _fly(flight, trace.take, show)
    finally:
        trace.close()  # of an interrupted flight, too: it can be read


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
