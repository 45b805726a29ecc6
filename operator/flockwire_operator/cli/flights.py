"""Commands for a flight: `up`, `conduct`, `sim`, `probe`."""

from __future__ import annotations

import asyncio
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from flockwire_core import clock
from flockwire_core.runtime.standard_streams import unblocked
from flockwire_core.swarm.model import Swarm
from flockwire_core.wire.plan import Plan

from flockwire_operator.cli.arguments import FaultsFile, Keys, SwarmFile, Verbose, Without, left_out
from flockwire_operator.cli.inputs import faults_of, finite, load, made_keys, refuse, refused, this_host, trace_folder
from flockwire_operator.station.folders import keys_folder, warn_of

if TYPE_CHECKING:
    from flockwire_lab.flight import Flight

app = typer.Typer()
UntilLanding = Annotated[
    float, typer.Option(min=0.0, callback=finite, help="Seconds from take-off to landing; 0: until Ctrl-C.")
]
NO_TRACE = "--out = {out}: there is no trace of this flight; does the recorder run, with this folder?"


@app.command()
def up(
    swarm: SwarmFile,
    duration: UntilLanding = 40.0,
    out: Annotated[Path | None, typer.Option(help="Folder for trace, report and logs [runs/NAME-TIME].")] = None,
    headless: Annotated[bool, typer.Option("--headless", help="No live table.")] = False,
    keys: Keys = None,
    host: Annotated[str | None, typer.Option(help="This host's name in [hosts] [the first].")] = None,
    faults: FaultsFile = None,
    without: Without = None,
    verbose: Verbose = False,
) -> None:
    """Start all processes of this host, fly, land, report."""
    from flockwire_operator.cli.verdict import conclude  # noqa: PLC0415
    from flockwire_operator.station.conduct import fly  # noqa: PLC0415
    from flockwire_operator.station.fault_injection import unable  # noqa: PLC0415
    from flockwire_operator.station.host import Host  # noqa: PLC0415

    plan = load(swarm)
    loaded = plan.swarm
    here = this_host(loaded, host)
    wrong = faults_of(faults, plan, partial(unable, plan, here))
    if without and not plan.conducts(here):
        refuse(f"--without: host {here!r} gives no orders; use it on the recorder's host")
    absent = left_out(plan, without)
    secrets = made_keys(swarm, plan, keys, here)
    folder = trace_folder(out, loaded.name)
    flying = Host(plan, swarm, here, folder, secrets, faults)
    _predict(loaded, duration, verbose)
    with refused(folder), unblocked():
        failure = asyncio.run(fly(flying, duration, headless, wrong, absent))
        raise typer.Exit(conclude(failure, folder, flying.conducts, verbose))


@app.command()
def conduct(
    swarm: SwarmFile,
    duration: UntilLanding = 40.0,
    out: Annotated[
        Path | None, typer.Option(help="The folder of the recorder's dated folders; the newest gets the report.")
    ] = None,
    headless: Annotated[bool, typer.Option("--headless", help="No live table.")] = False,
    keys: Keys = None,
    verbose: Verbose = False,
) -> None:
    """Fly a swarm whose processes already run (containers, services): take off, formation, land, report."""
    from flockwire_recorder.folders import newest_folder, newest_size  # noqa: PLC0415

    from flockwire_operator.cli.verdict import conclude, verdict  # noqa: PLC0415
    from flockwire_operator.station import conduct as conducting  # noqa: PLC0415

    plan = load(swarm)
    warn_of(plan.swarm)
    before = newest_size(out) if out is not None else None
    with refused(), unblocked():
        failure = asyncio.run(conducting.conduct(plan, keys_folder(swarm, plan, keys), duration, out, headless))
        folder = newest_folder(out) if out is not None and newest_size(out) != before else None
        if folder is None:
            raise typer.Exit(verdict(filter(None, (failure, NO_TRACE.format(out=out) if out is not None else ""))))
        raise typer.Exit(conclude(failure, folder, verbose=verbose))


@app.command()
def sim(
    swarm: SwarmFile,
    seed: Annotated[int, typer.Option(min=0, help="Random seed; equal seeds give equal flights.")] = 0,
    duration: Annotated[float, typer.Option(min=1.0, callback=finite, help="Seconds from take-off to landing.")] = 40.0,
    out: Annotated[Path | None, typer.Option(help="Folder for trace and report [runs/NAME-sim-SEED-TIME].")] = None,
    faults: FaultsFile = None,
    no_trace: Annotated[bool, typer.Option("--no-trace", help="Print the figures only; write no files.")] = False,
    without: Without = None,
    verbose: Verbose = False,
) -> None:
    """Fly the same swarm in virtual time, many times faster; report."""
    from flockwire_lab.faults.injection import unable  # noqa: PLC0415
    from flockwire_lab.flight import Flight  # noqa: PLC0415

    plan = Plan(load(swarm).swarm.in_simulation())
    loaded = plan.swarm
    wrong = faults_of(faults, plan, partial(unable, plan))
    absent = left_out(plan, without)
    _predict(loaded, duration, verbose)
    if no_trace and out is not None:
        refuse(f"--out = {out}: with --no-trace nothing is written")
    folder = None if no_trace else trace_folder(out, f"{loaded.name}-sim-{seed}")
    flight = Flight(loaded, seed, duration, wrong, absent)
    with refused(folder):
        raise typer.Exit(simulate(flight, verbose, folder, swarm.read_text(encoding="utf-8")))


def simulate(flight: Flight, verbose: bool, out: Path | None = None, toml: str = "") -> int:
    """Fly, print figures and verdict; returns the exit status.

    The trace, which holds the swarm file's text `toml`, and the report go into the folder `out`, if there is one.
    """
    from flockwire_analysis.summary import summarise  # noqa: PLC0415  (numpy)
    from flockwire_lab.flight import fly_in_memory, fly_recorded  # noqa: PLC0415

    from flockwire_operator.cli.verdict import conclude, print_figures, verdict  # noqa: PLC0415
    from flockwire_operator.station.terminal.progress import progress  # noqa: PLC0415

    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
    into = "" if out is None else f", into {out}"
    print(f"flockwire: {flight.swarm.name} in virtual time, seed {flight.seed}{into}", flush=True)
    began = clock.cpu_time()
    with progress("flight in virtual time", flight.duration) as show:

        def shown(flown: float) -> None:
            """Show how much has been flown, s."""
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
    return verdict(filter(None, (outcome.failure, *print_figures(summarise(trace), verbose))))


@app.command()
def probe(
    swarm: SwarmFile,
    out: Annotated[Path, typer.Option(help="Folder for probe.json.")] = Path("runs/probe"),
    keys: Keys = None,
) -> None:
    """Attack the swarm with every identity, key and link mode; name each leak and each blocked key."""
    from flockwire_operator.station.probe import run  # noqa: PLC0415

    plan = load(swarm)
    if plan.swarm.network.security == "none":
        refuse("network.security = 'none': nothing to probe; any process that reaches a port can read and write all")
    with refused(out):
        found = asyncio.run(run(plan, swarm, made_keys(swarm, plan, keys, next(iter(plan.swarm.hosts))), out))
    if found:
        refuse(f"the links do not conform to the graph: {found[0].sentence()}", 1)


def _predict(swarm: Swarm, duration: float, verbose: bool) -> None:
    """Print the predicted problems of a flight of `duration` s (0: without an end)."""
    from flockwire_operator.station.prediction import predicted  # noqa: PLC0415

    for line in predicted(swarm, duration, avoided=verbose):
        print(f"flockwire: warning: {line}", flush=True)
