"""`flockwire sim`: a whole flight in virtual time, and its report."""

from __future__ import annotations

from pathlib import Path

from flockwire import clock
from flockwire.domain.time import SECOND
from flockwire.process.faults import Fault
from flockwire.swarm.model import Swarm
from flockwire_analysis.summary import summarise
from flockwire_sim.recording import TraceFile, TraceInMemory
from flockwire_sim.world import EPOCH, Outcome, World
from flockwire_station.terminal.progress import progress
from flockwire_station.verdict import conclude, print_figures, verdict


def simulate(
    swarm: Swarm,
    toml: str,
    seed: int,
    duration: float,
    faults: tuple[Fault, ...],
    out: Path,
    without: tuple[int, ...] = (),
) -> int:
    """Fly `without` some drones into folder `out`, print figures, verdict; return the exit status. Raises OSError."""
    out.mkdir(parents=True, exist_ok=True)
    trace = TraceFile(out / "trace.mcap", swarm, toml, seed, faults)
    print(f"flockwire: {swarm.name} in virtual time, seed {seed}, into {out}", flush=True)
    try:
        outcome = _fly(World(swarm, seed, duration, faults, trace.take, without), duration)
    finally:
        trace.close()  # also after an interruption: it can be read
    return conclude(outcome.failure, out)


def simulate_in_memory(
    swarm: Swarm, seed: int, duration: float, faults: tuple[Fault, ...], without: tuple[int, ...] = ()
) -> int:
    """Fly `without` some drones, write nothing, print figures and verdict; returns the exit status."""
    trace = TraceInMemory(swarm, seed, faults)
    print(f"flockwire: {swarm.name} in virtual time, seed {seed}", flush=True)
    outcome = _fly(World(swarm, seed, duration, faults, trace.take, without), duration)
    failures = [outcome.failure] if outcome.failure else []
    failures += print_figures(summarise(trace.trace()))
    return verdict(failures)


def _fly(world: World, duration: float) -> Outcome:
    began, scheduler = clock.cpu_time(), world.scheduler
    with progress("flight in virtual time", duration) as show:

        def tick(_: object) -> None:
            flown = (scheduler.now - EPOCH) / SECOND
            show(f"{flown:.0f} s of flight", flown)
            scheduler.at(scheduler.now + SECOND, tick)

        scheduler.at(scheduler.now + SECOND, tick)
        outcome = world.run()
    used = max(clock.cpu_time() - began, 1e-9)
    faster = outcome.seconds / used
    print(f"flockwire: {outcome.seconds:.1f} s of flight in {used:.1f} s of processor time, {faster:.0f} x real time")
    return outcome
