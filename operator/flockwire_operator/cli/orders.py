"""Commands of the operator: orders in flight, and certificates."""

from __future__ import annotations

import asyncio
import sys
from pathlib import Path
from typing import Annotated

import typer
from flockwire_core.domain.order import Order
from flockwire_core.runtime.standard_streams import unblocked
from flockwire_core.swarm.wording import meant
from flockwire_core.wire.plan import Plan

from flockwire_operator.cli.arguments import AsJson, Keys, SwarmFile, Without, application, left_out
from flockwire_operator.cli.inputs import load, load_flying, refuse, refused
from flockwire_operator.station.folders import keys_folder, renew_keys, warn_of

app = application()


@app.command()
def start(
    swarm: SwarmFile,
    formation: Annotated[str, typer.Option(help="A name from [formations] [the first formation].")] = "",
    without: Without = None,
    keys: Keys = None,
) -> None:
    """Take off if necessary, and fly the formation."""
    plan = load(swarm)
    _known(plan, "--formation", formation)
    absent = left_out(plan, without)
    _give(plan, keys_folder(swarm, plan, keys), Order("start", formation, without=absent))


@app.command("hold", help="Leave the formation and hover.")
@app.command("land", help="Land all drones where they are.")
@app.command("stop", help="Emergency: motors off at once; flying drones fall.")
def down(context: typer.Context, swarm: SwarmFile, keys: Keys = None) -> None:
    """Give the order of the command's name to the swarm as it took off."""
    _give(*load_flying(swarm, keys), Order(str(context.info_name)))


@app.command()
def formation(
    swarm: SwarmFile,
    name: Annotated[str, typer.Argument(metavar="NAME", help="A name from [formations]; '' is the first formation.")],
    duration: Annotated[
        float | None, typer.Option(help="Seconds of the change [the fewest within all limits].")
    ] = None,
    keys: Keys = None,
) -> None:
    """Change to the formation NAME in flight; its time continues."""
    plan = load(swarm)
    _known(plan, "NAME", name)
    _give(plan, keys_folder(swarm, plan, keys), Order("formation", name, duration))


@app.command()
def status(
    swarm: SwarmFile,
    once: Annotated[bool, typer.Option("--once", help="Print it once; exit status 1 if a process has none.")] = False,
    keys: Keys = None,
    as_json: AsJson = False,
) -> None:
    """Show every drone and process of a running swarm: phase, position, battery, errors."""
    from flockwire_operator.station.watching import watch  # noqa: PLC0415

    plan, folder = load_flying(swarm, keys)
    with refused():
        missing = asyncio.run(watch(plan, folder, once, as_json))
    if missing:
        refuse(f"no status of {', '.join(missing)}", 1)


@app.command()
def teleop(swarm: SwarmFile, keys: Keys = None) -> None:
    """Steer a teleoperated leader by a gamepad, or by the keys of this terminal."""
    from flockwire_operator.station.teleop import steer, steered  # noqa: PLC0415  (zenoh)
    from flockwire_operator.station.terminal.gamepad import plugged_in  # noqa: PLC0415
    from flockwire_operator.station.terminal.keyboard import attached  # noqa: PLC0415

    plan = load(swarm)
    led, speed = steered(plan.swarm)
    if not led:
        kinds = ", ".join(sorted({leader.kind for leader in plan.swarm.leading.values()}))
        refuse(f"leader.kind = {kinds!r}: only a 'teleoperated' leader can be steered")
    gamepad, note = plugged_in(speed)
    if note:
        print(f"flockwire: {note}", file=sys.stderr)
    if gamepad is None and not attached():
        refuse("there is no terminal to read keys from, and no gamepad")
    warn_of(plan.swarm)
    with refused(), unblocked():
        done = asyncio.run(steer(plan, keys_folder(swarm, plan, keys), gamepad))
    raise typer.Exit(0 if done else 1)


@app.command()
def console(
    swarm: SwarmFile,
    address: Annotated[
        str, typer.Option(help="IP address to listen at; any but loopback shows the page to other hosts.")
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=1, max=65535, help="Port to listen at.")] = 8420,
    foxglove: Annotated[
        int | None,
        typer.Option(
            min=1,
            max=65535,
            metavar="PORT",
            help="Serve Foxglove and Lichtblick too, at this port (theirs is 8765); needs the extra foxglove.",
        ),
    ] = None,
    keys: Keys = None,
) -> None:
    """Serve a live page of a running swarm: map, table, orders, stop. Orders need the token in the printed link."""
    from flockwire_operator.console.command import serve  # noqa: PLC0415  (aiohttp)

    plan, folder = load_flying(swarm, keys)
    with refused(cannot=f"--port = {port}: cannot listen at {address}:{port}"), unblocked():
        served = asyncio.run(serve(plan, folder, address, port, foxglove))
    raise typer.Exit(0 if served else 1)


@app.command()
def keys(
    swarm: SwarmFile,
    out: Annotated[
        Path | None, typer.Option(help="Folder of the certificates [.flockwire/NAME/keys beside SWARM].")
    ] = None,
    rotate: Annotated[
        bool, typer.Option("--rotate", help="Make a new authority: all earlier keys are rejected.")
    ] = False,
) -> None:
    """Make the swarm's certificates, and renew those that expire soon."""
    plan = load(swarm)
    folder = keys_folder(swarm, plan, out)
    if rotate and plan.swarm.network.security == "mtls":
        from flockwire_operator.station.watching import flying  # noqa: PLC0415  (zenoh)

        # Drones may fly with them on other hosts; on this host, making keys checks it.
        if names := asyncio.run(flying(plan, folder)):
            refuse(
                f"--rotate: {', '.join(names)} may be in the air with the keys in {folder}: no order, not even a stop, "
                "would reach them with new ones; land first"
            )
    with refused():
        made = renew_keys(plan, folder, rotate)
    print(f"flockwire: {folder}: {', '.join(made) + ' made' if made else 'all good, nothing to do'}")


def _known(plan: Plan, argument: str, formation: str) -> None:
    known = plan.swarm.formations
    if formation and formation not in known:
        if not known:
            refuse(f"{argument} = {formation!r}: the swarm file has no [formations]")
        refuse(f"{argument} = {formation!r}: must be one of {sorted(known)} ([formations]){meant(formation, known)}")


def _give(plan: Plan, keys: Path, order: Order) -> None:
    from flockwire_operator.station.giving import give  # noqa: PLC0415

    warn_of(plan.swarm)
    with refused():
        answer = asyncio.run(give(plan, keys, order))
    if answer.confirmed:
        note = f"; {answer.note}" if answer.note else ""
        print(f"flockwire: {order.verb}: confirmed by {', '.join(answer.confirmed)}{note}")
    if answer.failure:
        refuse(f"{order.verb} failed: {answer.failure}", 1)
