"""Flights by script: `open_swarm` flies a swarm from Python coroutines, in real or in virtual time.

It starts the swarm's processes, real or virtual, and ends them with the script.
"""

from __future__ import annotations

from contextlib import AbstractAsyncContextManager
from pathlib import Path

from flockwire_core import clock
from flockwire_core.extras import require
from flockwire_core.loading import load_swarm
from flockwire_core.wire.plan import Plan

from flockwire_operator.scripting.flight import DroneStatus, Flight, FlightError
from flockwire_operator.station.folders import check_no_trace

__all__ = ["DroneStatus", "Flight", "FlightError", "open_swarm"]


def open_swarm(
    file: str | Path, virtual: bool = False, seed: int = 0, out: str | Path | None = None
) -> AbstractAsyncContextManager[Flight]:
    """Open the swarm of `file`; its processes run during the context.

    Flying drones land at the end of the context. `virtual` flies in virtual time, by `seed`. Trace and report go into
    the folder `out` (default: runs/NAME-script-TIME; in virtual time nothing is written without it). Raises
    SwarmFileError, PortInUseError, CredentialsError, FileExistsError if `out` has a trace of another flight,
    ModuleNotFoundError without the extra `report`, which a flight with a trace needs.
    """
    path, folder = Path(file), None if out is None else Path(out)
    plan = Plan(load_swarm(path))
    if folder is not None or not virtual:
        require("matplotlib", "report", "the report")
    if folder is not None:
        check_no_trace(folder)
    if virtual:
        from flockwire_operator.scripting.virtual import virtual_flight  # noqa: PLC0415

        return virtual_flight(plan, path, seed, folder)
    from flockwire_operator.scripting.real import real_flight  # noqa: PLC0415

    return real_flight(plan, path, Path(out or f"runs/{plan.swarm.name}-script-{clock.local():%Y%m%d-%H%M%S}"))
