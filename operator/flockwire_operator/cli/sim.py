"""`flockwire sim`: a whole flight in virtual time, and its report."""

from __future__ import annotations

from pathlib import Path

from flockwire_analysis.summary import summarise
from flockwire_core import clock
from flockwire_lab.flight import Flight, fly_in_memory, fly_recorded

from flockwire_operator.cli.verdict import conclude, print_figures, verdict
from flockwire_operator.station.terminal.progress import progress


def simulate(flight: Flight, out: Path | None = None, toml: str = "", verbose: bool = False) -> int:
    """Fly, print figures, all if `verbose`, and verdict; returns the exit status.

    The trace, which holds the swarm file's text `toml`, and the report go into the folder `out`; nothing is written
    without it. Raises OSError.
    """
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
    into = "" if out is None else f", into {out}"
    print(f"flockwire: {flight.swarm.name} in virtual time, seed {flight.seed}{into}", flush=True)
    began = clock.cpu_time()
    with progress("flight in virtual time", flight.duration) as show:

        def shown(flown: float) -> None:
            show(f"{flown:.0f} s of flight", flown)

        if out is not None:
            outcome = fly_recorded(flight, toml, out / "trace.mcap", shown)
        else:
            outcome, trace = fly_in_memory(flight, shown)
    used = max(clock.cpu_time() - began, 1e-9)
    faster = outcome.seconds / used
    print(f"flockwire: {outcome.seconds:.1f} s of flight in {used:.1f} s of processor time, {faster:.0f} x real time")
    for line in outcome.slow:
        print(f"flockwire: warning: {line} in a real flight on this machine")
    if out is not None:
        return conclude(outcome.failure, out, verbose=verbose)
    failures = print_figures(summarise(trace), verbose)
    return verdict(filter(None, (outcome.failure, *failures)))
