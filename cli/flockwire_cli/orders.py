"""Commands that are the operator's: orders in flight, and the certificates."""

from __future__ import annotations

import asyncio
import sys
from pathlib import Path
from typing import Annotated

import typer
from flockwire import clock
from flockwire.security.files import CredentialsError, default_folder
from flockwire.wire.plan import Plan

from flockwire_cli.arguments import Keys, SwarmFile, load, refuse, warn_of, written

app = typer.Typer()


@app.command()
def start(
    swarm: SwarmFile,
    formation: Annotated[str, typer.Option(help="A name from [formations] [the first formation].")] = "",
    keys: Keys = None,
) -> None:
    """Take off where need be, and fly the formation."""
    plan = load(swarm)
    _known(plan, "--formation", formation)
    _give(plan, keys, "start", formation)


@app.command()
def hold(swarm: SwarmFile, keys: Keys = None) -> None:
    """Leave the formation and hover on the spot."""
    _give(load(swarm, checked=False), keys, "hold")


@app.command()
def land(swarm: SwarmFile, keys: Keys = None) -> None:
    """Land all drones where they are."""
    _give(load(swarm, checked=False), keys, "land")


@app.command()
def stop(swarm: SwarmFile, keys: Keys = None) -> None:
    """Emergency: motors off, at once; what flies falls."""
    _give(load(swarm, checked=False), keys, "stop")


@app.command()
def formation(swarm: SwarmFile, name: Annotated[str, typer.Argument(metavar="NAME")], keys: Keys = None) -> None:
    """Change to the formation NAME of [formations]; its time goes on."""
    plan = load(swarm)
    _known(plan, "NAME", name)
    _give(plan, keys, "formation", name)


@app.command()
def keys(
    swarm: SwarmFile,
    out: Annotated[Path | None, typer.Option(help="Folder of the certificates [.flockwire/NAME/keys].")] = None,
    rotate: Annotated[
        bool, typer.Option("--rotate", help="A new authority: all keys made before are rejected.")
    ] = False,
) -> None:
    """Make the swarm's certificates, and renew what is about to expire."""
    from flockwire.security.pki import make_keys  # noqa: PLC0415

    plan = load(swarm)
    folder = out or default_folder(plan.swarm.name)
    made = written(folder, lambda: make_keys(plan, folder, clock.utc(), rotate))
    print(f"flockwire: {folder}: {', '.join(made) + ' made' if made else 'all good, nothing to do'}")


def _known(plan: Plan, argument: str, formation: str) -> None:
    known = plan.swarm.formations
    if formation and formation not in known:
        refuse(f"{argument} = {formation!r}: must be one of {sorted(known)} ([formations])")


def _give(plan: Plan, keys: Path | None, verb: str, formation: str = "") -> None:
    from flockwire_cli.giving import give  # noqa: PLC0415

    warn_of(plan.swarm)
    try:
        answer = asyncio.run(give(plan, keys, verb, formation))
    except CredentialsError as error:
        refuse(str(error))
    if answer.confirmed:
        print(f"flockwire: {verb}: confirmed by {', '.join(answer.confirmed)}")
    if answer.refusal or answer.missing:
        reason = answer.refusal or f"sent, but not confirmed by {', '.join(answer.missing)}"
        print(f"flockwire: {verb} failed: {reason}", file=sys.stderr)
        raise typer.Exit(1)
