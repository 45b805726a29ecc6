"""The `flockwire` command: the contract between the project and its users' scripts.

Exit status: 0 all well; 1 a flight failed, its reason on the last line; 2 bad usage or a bad swarm file.
"""

from __future__ import annotations

import asyncio
import os
import sys
from collections.abc import Coroutine
from datetime import datetime
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

import typer
from flockwire import clock
from flockwire.config import Swarm, SwarmFileError, load_swarm
from flockwire.credentials import CredentialsError, default_folder, load_credentials
from flockwire.wiring import OPERATOR, processes_on

if TYPE_CHECKING:
    from flockwire.faults import Fault

app = typer.Typer(
    help="Distributed edge runtime for formation flight: one process per drone, on Zenoh.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)

SwarmFile = Annotated[Path, typer.Argument(metavar="SWARM", help="The swarm file (TOML).")]
Keys = Annotated[
    Path | None, typer.Option(envvar="FLOCKWIRE_KEYS", help="Folder of the certificates [.flockwire/NAME/keys].")
]
FaultsFile = Annotated[Path | None, typer.Option(help="What is to go wrong, and when (TOML).")]
Number = Annotated[int, typer.Argument(metavar="ID", help="The drone's id.")]


@app.command()
def check(swarm: SwarmFile, keys: Keys = None) -> None:
    """Validate a swarm file; print its graph, observer bounds, formations, links and warnings."""
    from flockwire.pki import expiring  # noqa: PLC0415

    from flockwire_cli.check import describe  # noqa: PLC0415  (numpy)

    loaded = _load(swarm)
    print(describe(loaded))
    for line in expiring(loaded, keys or default_folder(loaded.name), clock.utc()):
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
    from flockwire_cli.misfortune import refusal  # noqa: PLC0415
    from flockwire_cli.processes import PortInUseError  # noqa: PLC0415
    from flockwire_cli.up import Flight, conclude, fly  # noqa: PLC0415

    if not isfinite(duration):
        _refuse(f"--duration = {duration}: must be a number of seconds; 0 flies until Ctrl-C")
    loaded = _load(swarm)
    wrong = _faults(faults, loaded)
    if host is not None and host not in loaded.hosts:
        _refuse(f"--host = {host!r}: must be one of {sorted(loaded.hosts)} ([hosts])")
    here = host or next(iter(loaded.hosts))
    if cannot := refusal(wrong, loaded, here):
        _refuse(f"{faults}: {cannot}")
    folder = out or Path("runs") / f"{loaded.name}-{datetime.now().astimezone():%Y%m%d-%H%M%S}"
    if (folder / "trace.mcap").exists():
        _refuse(f"--out = {folder}: there is a trace of another flight; name a new folder")
    flight = Flight(loaded, swarm, here, duration, folder, _made(loaded, keys, here), headless, wrong, faults)
    try:
        failure = asyncio.run(fly(flight))
    except (PortInUseError, CredentialsError) as error:
        _refuse(str(error))
    except OSError as error:
        _refuse(f"--out = {folder}: cannot write there: {error.strerror}")
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
    from flockwire_cli.sim import simulate, simulate_in_memory  # noqa: PLC0415

    loaded = _load(swarm)
    wrong = _faults(faults, loaded)
    if no_trace:
        if out is not None:
            _refuse(f"--out = {out}: with --no-trace nothing is written")
        raise typer.Exit(simulate_in_memory(loaded, seed, duration, wrong))
    folder = out or Path("runs") / f"{loaded.name}-sim-{seed}-{datetime.now().astimezone():%Y%m%d-%H%M%S}"
    if (folder / "trace.mcap").exists():
        _refuse(f"--out = {folder}: there is a trace of another flight; name a new folder")
    try:
        status = simulate(loaded, swarm.read_text(encoding="utf-8"), seed, duration, wrong, folder)
    except OSError as error:
        _refuse(f"--out = {folder}: cannot write there: {error.strerror}")
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
    """Fly the swarm many times in virtual time, each time a little different; tell how often all goes well."""
    from flockwire_sim.study.plan import StudyError  # noqa: PLC0415

    from flockwire_cli import study as studies  # noqa: PLC0415  (numpy)

    loaded = _load(swarm)
    folder = out or Path("runs") / f"{loaded.name}-study-{datetime.now().astimezone():%Y%m%d-%H%M%S}"
    try:
        options = studies.options_of(runs, seed, duration, random_starts)
        status = studies.study(swarm, file, options, folder, jobs or os.cpu_count() or 1, scheduler)
    except (StudyError, SwarmFileError) as error:
        _refuse(str(error))
    except OSError as error:
        _refuse(f"--out = {folder}: cannot write there: {error.strerror}")
    raise typer.Exit(status)


@app.command()
def agent(swarm: SwarmFile, number: Number, keys: Keys = None) -> None:
    """Run the agent of one follower."""
    from flockwire_agent.process import run  # noqa: PLC0415

    loaded = _load(swarm)
    if number not in loaded.followers:
        _refuse(f"ID = {number}: must be one of the followers {list(loaded.followers)}")
    _serve(f"uav{number}", run(loaded, number, keys))


@app.command()
def leader(swarm: SwarmFile, keys: Keys = None) -> None:
    """Run the leader."""
    from flockwire_leader.process import run  # noqa: PLC0415

    _serve("leader", run(_load(swarm), keys))


@app.command()
def gateway(swarm: SwarmFile, keys: Keys = None, faults: FaultsFile = None) -> None:
    """Run the gateway, which serves poses and what is nearby."""
    from flockwire_mocap.process import run  # noqa: PLC0415

    loaded = _load(swarm)
    _serve("gateway", run(loaded, keys, _faults(faults, loaded)))


@app.command()
def kinematics(swarm: SwarmFile, keys: Keys = None, faults: FaultsFile = None) -> None:
    """Run the simulated airframes with their drivers."""
    from flockwire_tello.process import run  # noqa: PLC0415

    loaded = _load(swarm)
    _serve("kinematics", run(loaded, keys, _faults(faults, loaded)))


@app.command()
def router(swarm: SwarmFile, keys: Keys = None) -> None:
    """Run the router of `[network] mode = "router"`."""
    from flockwire.router import run  # noqa: PLC0415

    loaded = _load(swarm)
    if loaded.network.mode != "router":
        _refuse(f"network.mode = {loaded.network.mode!r}: only mode = 'router' has a router")
    _serve("router", run(loaded, keys))


@app.command()
def recorder(
    swarm: SwarmFile,
    out: Annotated[Path, typer.Option(help="Folder for trace.mcap.")] = Path("runs/recording"),
    keys: Keys = None,
) -> None:
    """Record everything that is said into OUT/trace.mcap."""
    from flockwire_recorder.process import run  # noqa: PLC0415

    loaded = _load(swarm)
    if (out / "trace.mcap").exists():
        _refuse(f"--out = {out}: there is a trace of another flight; name a new folder")
    _serve("recorder", run(loaded, swarm.read_text(encoding="utf-8"), out, keys))


@app.command()
def start(
    swarm: SwarmFile,
    formation: Annotated[str, typer.Option(help="A name from [formations] [the first formation].")] = "",
    keys: Keys = None,
) -> None:
    """Take off where need be, and fly the formation."""
    loaded = _load(swarm)
    if formation and formation not in loaded.formations:
        _refuse(f"--formation = {formation!r}: must be one of {sorted(loaded.formations)} ([formations])")
    _give(loaded, keys, "start", formation)


@app.command()
def hold(swarm: SwarmFile, keys: Keys = None) -> None:
    """Leave the formation and hover on the spot."""
    _give(_load(swarm), keys, "hold")


@app.command()
def land(swarm: SwarmFile, keys: Keys = None) -> None:
    """Land all drones where they are."""
    _give(_load(swarm), keys, "land")


@app.command()
def stop(swarm: SwarmFile, keys: Keys = None) -> None:
    """Emergency: motors off, at once; what flies falls."""
    _give(_load(swarm), keys, "stop")


@app.command()
def formation(swarm: SwarmFile, name: Annotated[str, typer.Argument(metavar="NAME")], keys: Keys = None) -> None:
    """Change to the formation NAME of [formations]."""
    start(swarm, name, keys)


@app.command()
def keys(
    swarm: SwarmFile,
    out: Annotated[Path | None, typer.Option(help="Folder of the certificates [.flockwire/NAME/keys].")] = None,
    rotate: Annotated[
        bool, typer.Option("--rotate", help="A new authority: all keys made before are worthless.")
    ] = False,
) -> None:
    """Make the swarm's certificates, and renew what is about to expire."""
    from flockwire.pki import make_keys  # noqa: PLC0415

    loaded = _load(swarm)
    folder = out or default_folder(loaded.name)
    made = _written(folder, lambda: make_keys(loaded, folder, clock.utc(), rotate))
    print(f"flockwire: {folder}: {', '.join(made) + ' made' if made else 'all good, nothing to do'}")


@app.command()
def probe(
    swarm: SwarmFile,
    out: Annotated[Path, typer.Option(help="Folder for probe.json.")] = Path("runs/probe"),
    keys: Keys = None,
) -> None:
    """Attack the swarm with every identity, key and link mode; name each leak and each thing blocked."""
    from flockwire_cli.probe import run  # noqa: PLC0415
    from flockwire_cli.processes import PortInUseError  # noqa: PLC0415

    loaded = _load(swarm)
    if loaded.network.security == "none":
        _refuse("network.security = 'none': there is nothing to prove; whoever reaches a port hears and says all")
    try:
        found = asyncio.run(run(loaded, swarm, _made(loaded, keys, next(iter(loaded.hosts))), out))
    except (PortInUseError, CredentialsError, FileNotFoundError) as error:
        _refuse(str(error))
    if found:
        print(f"flockwire: the wire is not as the graph says: {found[0].sentence()}", file=sys.stderr)
        raise typer.Exit(1)


@app.command()
def report(
    trace: Annotated[Path, typer.Argument(metavar="TRACE", help="A trace.mcap.")],
    out: Annotated[Path | None, typer.Option(help="Folder for the report [the trace's].")] = None,
) -> None:
    """Draw the figures of a trace; write report.html and summary.json."""
    from flockwire_recorder.report import write_report  # noqa: PLC0415

    from flockwire_cli.verdict import print_summary  # noqa: PLC0415

    folder = out or trace.parent
    failures = print_summary(_trace(lambda: write_report(trace, folder)), folder)
    if failures:
        print(f"flockwire: {'; '.join(failures)}", file=sys.stderr)
        raise typer.Exit(1)


@app.command()
def recover(
    trace: Annotated[Path, typer.Argument(metavar="TRACE", help="A trace that was cut off.")],
    out: Annotated[Path | None, typer.Option(help="The whole trace to write [TRACE-recovered.mcap].")] = None,
) -> None:
    """Make a trace whole that was cut off by a crash."""
    from flockwire_recorder.recover import recover as make_whole  # noqa: PLC0415

    target = out or trace.with_name(f"{trace.stem}-recovered.mcap")
    if target.exists():
        _refuse(f"--out = {target}: exists; name a new file")
    found = _trace(lambda: make_whole(trace, target))
    print(f"flockwire: {found.messages} messages recovered into {target}")


def main() -> NoReturn:
    """Run the command line."""
    app(prog_name="flockwire")
    raise SystemExit(0)


def _load(path: Path) -> Swarm:
    try:
        return load_swarm(path)
    except SwarmFileError as error:
        _refuse(str(error))


def _faults(path: Path | None, swarm: Swarm) -> tuple[Fault, ...]:
    from flockwire.faults import FaultFileError, load_faults  # noqa: PLC0415

    try:
        return load_faults(path, swarm) if path is not None else ()
    except FaultFileError as error:
        _refuse(str(error))


def _trace(work: Any) -> Any:  # noqa: ANN401  (it passes through whatever `work` returns)
    """Do `work` on a trace; what is wrong with the trace ends the program."""
    try:
        return work()
    except (OSError, ValueError) as error:
        _refuse(str(error))


def _warn_of(swarm: Swarm) -> None:
    if swarm.network.security == "none":
        print(
            "flockwire: warning: network.security = 'none': whoever reaches a port hears and says all", file=sys.stderr
        )


def _made(swarm: Swarm, keys: Path | None, host: str) -> Path:
    """Return the folder of the certificates, after making what it lacks where the authority's key is or may be here."""
    from flockwire.pki import make_keys  # noqa: PLC0415

    folder = keys or default_folder(swarm.name)
    _warn_of(swarm)
    first = next(iter(swarm.hosts)) == host  # another host's keys come from the first one
    here = (first and not (folder / "ca.crt").exists()) or (folder / "authority" / "ca.key").exists()
    if swarm.network.security == "mtls":
        if here:
            _written(folder, lambda: make_keys(swarm, folder, clock.utc()))
        try:
            for identity in (*processes_on(swarm, host), OPERATOR):
                load_credentials(folder, identity, clock.utc())
        except CredentialsError as error:
            _refuse(str(error))
    return folder


def _written(folder: Path, work: Any) -> Any:  # noqa: ANN401  (it passes through whatever `work` returns)
    try:
        return work()
    except OSError as error:
        _refuse(f"{folder}: cannot write keys there: {error.strerror or error}")
    except ValueError as error:
        _refuse(str(error))


def _serve(identity: str, process: Coroutine[None, None, None]) -> NoReturn:
    from flockwire.runtime import main as serve  # noqa: PLC0415

    raise typer.Exit(serve(identity, process))


def _give(swarm: Swarm, keys: Path | None, verb: str, formation: str = "") -> None:
    from flockwire_cli.operator import give  # noqa: PLC0415

    _warn_of(swarm)
    try:
        failure = asyncio.run(give(swarm, keys, verb, formation))
    except CredentialsError as error:
        _refuse(str(error))
    if failure:
        print(f"flockwire: {verb} failed: {failure}", file=sys.stderr)
        raise typer.Exit(1)


def _refuse(reason: str) -> NoReturn:
    print("\n".join(f"flockwire: {line}" for line in reason.split("\n")), file=sys.stderr)
    raise typer.Exit(2)
