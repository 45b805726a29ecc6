"""Commands that run one process of a swarm, as systemd and compose start them."""

from __future__ import annotations

from collections.abc import Coroutine
from pathlib import Path
from typing import Annotated, NoReturn

import typer

from flockwire_cli.arguments import FaultsFile, Keys, Number, SwarmFile, faults_of, load, refuse, refuse_a_second_trace

app = typer.Typer()


@app.command()
def agent(swarm: SwarmFile, number: Number, keys: Keys = None) -> None:
    """Run the agent of one follower."""
    from flockwire_agent.process import run  # noqa: PLC0415

    loaded = load(swarm)
    if number not in loaded.followers:
        refuse(f"ID = {number}: must be one of the followers {list(loaded.followers)}")
    _serve(f"uav{number}", run(loaded, number, keys))


@app.command()
def leader(swarm: SwarmFile, keys: Keys = None) -> None:
    """Run the leader."""
    from flockwire_leader.process import run  # noqa: PLC0415

    _serve("leader", run(load(swarm), keys))


@app.command()
def gateway(swarm: SwarmFile, keys: Keys = None, faults: FaultsFile = None) -> None:
    """Run the gateway, which serves poses and what is nearby."""
    from flockwire_mocap.process import run  # noqa: PLC0415

    loaded = load(swarm)
    _serve("gateway", run(loaded, keys, faults_of(faults, loaded)))


@app.command()
def kinematics(swarm: SwarmFile, keys: Keys = None, faults: FaultsFile = None) -> None:
    """Run the simulated airframes with their drivers."""
    from flockwire_tello.process import run  # noqa: PLC0415

    loaded = load(swarm)
    _serve("kinematics", run(loaded, keys, faults_of(faults, loaded)))


@app.command()
def router(swarm: SwarmFile, keys: Keys = None) -> None:
    """Run the router of `[network] mode = "router"`."""
    from flockwire.router import run  # noqa: PLC0415

    loaded = load(swarm)
    if loaded.network.mode != "router":
        refuse(f"network.mode = {loaded.network.mode!r}: only mode = 'router' has a router")
    _serve("router", run(loaded, keys))


@app.command()
def recorder(
    swarm: SwarmFile,
    out: Annotated[Path, typer.Option(help="Folder for trace.mcap.")] = Path("runs/recording"),
    keys: Keys = None,
) -> None:
    """Record everything that is said into OUT/trace.mcap."""
    from flockwire_recorder.process import run  # noqa: PLC0415

    loaded = load(swarm)
    refuse_a_second_trace(out)
    _serve("recorder", run(loaded, swarm.read_text(encoding="utf-8"), out, keys))


def _serve(identity: str, process: Coroutine[None, None, None]) -> NoReturn:
    from flockwire.runtime import main as serve  # noqa: PLC0415

    raise typer.Exit(serve(identity, process))
