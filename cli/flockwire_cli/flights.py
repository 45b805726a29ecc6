"""Commands that fly, or look at what would: `check`, `up`, `sim`, `study`, `probe`."""

from __future__ import annotations

import asyncio
import os
import sys
from math import isfinite
from pathlib import Path
from typing import Annotated

import typer
from flockwire import clock
from flockwire.loading import SwarmFileError
from flockwire.security.files import CredentialsError, default_folder

from flockwire_cli.arguments import (
    FaultsFile,
    Keys,
    SwarmFile,
    faults_of,
    load,
    made_keys,
    refuse,
    refuse_a_second_trace,
)

app = typer.Typer()


@app.command()
def check(swarm: SwarmFile, keys: Keys = None) -> None:
    """Validate a swarm file; print its graph, observer bounds, formations, links and warnings."""
    from flockwire.security.pki import expiring  # noqa: PLC0415

    from flockwire_cli.check import describe  # noqa: PLC0415  (numpy)

    plan = load(swarm)
    print(describe(plan))
    for line in expiring(plan, keys or default_folder(plan.swarm.name), clock.utc()):
        print(f"warning: {line}")


@app.command()
def up(
    swarm: SwarmFile,
    duration: Annotated[float, typer.Option(min=0.0, help="Seconds from take-off to landing; 0: until Ctrl-C.")] = 40.0,
    out: Annotated[Path | None, typer.Option(help="Folder for trace, report and logs [runs/NAME-TIME].")] = None,
    headless: Annotated[bool, typer.Option("--headless", help="No live table.")] = False,
    keys: Keys = None,
    host: Annotated[str | None, typer.Option(help="Which of [hosts] this is [the first].")] = None,
    faults: FaultsFile = None,
) -> None:
    """Start all processes of this host, fly, land, report."""
    from flockwire_cli.fault_injection import refusal  # noqa: PLC0415
    from flockwire_cli.processes import PortInUseError  # noqa: PLC0415
    from flockwire_cli.up import UpOptions, fly  # noqa: PLC0415
    from flockwire_cli.verdict import conclude  # noqa: PLC0415

    if not isfinite(duration):
        refuse(f"--duration = {duration}: must be a number of seconds; 0 flies until Ctrl-C")
    plan = load(swarm)
    loaded = plan.swarm
    wrong = faults_of(faults, plan)
    if host is not None and host not in loaded.hosts:
        refuse(f"--host = {host!r}: must be one of {sorted(loaded.hosts)} ([hosts])")
    here = host or next(iter(loaded.hosts))
    if cannot := refusal(wrong, plan, here):
        refuse(f"{faults}: {cannot}")
    folder = out or Path("runs") / f"{loaded.name}-{clock.local():%Y%m%d-%H%M%S}"
    refuse_a_second_trace(folder)
    flight = UpOptions(plan, swarm, here, duration, folder, made_keys(plan, keys, here), headless, wrong, faults)
    try:
        failure = asyncio.run(fly(flight))
    except (PortInUseError, CredentialsError) as error:
        refuse(str(error))
    except OSError as error:
        refuse(f"--out = {folder}: cannot write there: {error.strerror}")
    raise typer.Exit(conclude(failure, folder, flight.conducts))


@app.command()
def sim(
    swarm: SwarmFile,
    seed: Annotated[int, typer.Option(min=0, help="Of all that is left to chance; equal seeds, equal flights.")] = 0,
    duration: Annotated[float, typer.Option(min=1.0, help="Seconds from take-off to landing.")] = 40.0,
    out: Annotated[Path | None, typer.Option(help="Folder for trace and report [runs/NAME-sim-SEED-TIME].")] = None,
    faults: FaultsFile = None,
    no_trace: Annotated[bool, typer.Option("--no-trace", help="Write nothing, only print the figures.")] = False,
) -> None:
    """Fly the same swarm in virtual time, many times faster; report."""
    from flockwire_sim.fault_injection import refusal  # noqa: PLC0415

    from flockwire_cli.sim import simulate, simulate_in_memory  # noqa: PLC0415

    plan = load(swarm)
    loaded = plan.swarm
    wrong = faults_of(faults, plan)
    if cannot := refusal(wrong, plan):
        refuse(f"{faults}: {cannot}")
    if no_trace:
        if out is not None:
            refuse(f"--out = {out}: with --no-trace nothing is written")
        raise typer.Exit(simulate_in_memory(loaded, seed, duration, wrong))
    folder = out or Path("runs") / f"{loaded.name}-sim-{seed}-{clock.local():%Y%m%d-%H%M%S}"
    refuse_a_second_trace(folder)
    try:
        status = simulate(loaded, swarm.read_text(encoding="utf-8"), seed, duration, wrong, folder)
    except OSError as error:
        refuse(f"--out = {folder}: cannot write there: {error.strerror}")
    raise typer.Exit(status)


@app.command()
def study(
    swarm: SwarmFile,
    file: Annotated[Path | None, typer.Argument(metavar="STUDY", help="What is varied (TOML).")] = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder; a second call goes on in it [runs/NAME-study-TIME].")
    ] = None,
    runs: Annotated[int | None, typer.Option(min=1, help="Flights at each grid point [100].")] = None,
    seed: Annotated[int | None, typer.Option(min=0, help="Of the whole study [0].")] = None,
    duration: Annotated[float | None, typer.Option(min=1.0, help="Seconds of each flight [20].")] = None,
    random_starts: Annotated[str | None, typer.Option(metavar="WxD", help="Start anywhere in a box, like 6x6.")] = None,
    jobs: Annotated[int, typer.Option(min=0, help="Processes of this machine; 0: one for each core.")] = 0,
    scheduler: Annotated[str, typer.Option(metavar="ADDRESS", help="Of a Dask cluster, which flies instead.")] = "",
) -> None:
    """Fly the swarm many times in virtual time, each time a little different; report how often all goes well."""
    from flockwire_sim.study.file import StudyError  # noqa: PLC0415

    from flockwire_cli import study as studies  # noqa: PLC0415  (numpy)

    loaded = load(swarm).swarm
    folder = out or Path("runs") / f"{loaded.name}-study-{clock.local():%Y%m%d-%H%M%S}"
    try:
        options = studies.options_of(runs, seed, duration, random_starts)
        status = studies.study(swarm, file, options, folder, jobs or os.cpu_count() or 1, scheduler)
    except (StudyError, SwarmFileError) as error:
        refuse(str(error))
    except OSError as error:
        refuse(f"--out = {folder}: cannot write there: {error.strerror}")
    raise typer.Exit(status)


@app.command()
def probe(
    swarm: SwarmFile,
    out: Annotated[Path, typer.Option(help="Folder for probe.json.")] = Path("runs/probe"),
    keys: Keys = None,
) -> None:
    """Attack the swarm with every identity, key and link mode; name each leak and each thing blocked."""
    from flockwire_cli.probe import run  # noqa: PLC0415
    from flockwire_cli.processes import PortInUseError  # noqa: PLC0415

    plan = load(swarm)
    if plan.swarm.network.security == "none":
        refuse("network.security = 'none': there is nothing to prove; anybody who reaches a port reads and writes all")
    try:
        found = asyncio.run(run(plan, swarm, made_keys(plan, keys, next(iter(plan.swarm.hosts))), out))
    except (PortInUseError, CredentialsError, FileNotFoundError) as error:
        refuse(str(error))
    if found:
        print(f"flockwire: the wire does not conform to the graph: {found[0].sentence()}", file=sys.stderr)
        raise typer.Exit(1)
