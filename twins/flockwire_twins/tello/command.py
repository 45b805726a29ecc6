"""The command `tello-sim`: one simulated Tello, without a swarm, for authors of Tello clients."""

from __future__ import annotations

import asyncio
from typing import Annotated
from zlib import crc32

import typer

from flockwire_twins.tello.parameters import USUAL, Quirk, TelloParameters, switched


def tello_sim(
    address: Annotated[
        str, typer.Option(help="Address of this host to serve at; 127.0.0.3, .4, … for more.")
    ] = "127.0.0.2",
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port of commands.")] = 8889,
    state_port: Annotated[int, typer.Option(min=1, max=65535, help="Port of the client that gets the state.")] = 8890,
    sdk: Annotated[str, typer.Option(help="1.3 (Tello), 2.0 (EDU) or 3.0 (RoboMaster TT).")] = "2.0",
    quirk: Annotated[
        list[str] | None, typer.Option(help="Behaviour of real Tellos, or no-NAME; `list` shows all.")
    ] = None,
    seed: Annotated[int, typer.Option(help="Seed of reply times and losses.")] = 0,
) -> None:
    """Serve a simulated Tello over UDP: any Tello client can fly it."""
    from flockwire_twins.tello.server import serve  # noqa: PLC0415  (asyncio)

    names = quirk or []
    if "list" in names:
        print("\n".join(f"{q.value:<26} {'on ' if q in USUAL else 'off'}  {q.__doc__}" for q in Quirk))
        return
    if sdk not in ("1.3", "2.0", "3.0"):
        raise ValueError(f"--sdk = {sdk!r}: must be 1.3, 2.0 or 3.0")
    try:
        quirks = switched(names)
    except ValueError as error:
        raise ValueError(f"--quirk = {error}") from None

    try:
        serial = f"0TQZSI{crc32(f'{address}:{port}'.encode()):08X}"
        parameters = TelloParameters(generation=sdk, quirks=quirks, state_port=state_port, serial=serial)  # type: ignore[arg-type]
        asyncio.run(serve(parameters, (address, port), seed, lambda line: print(f"flockwire: {line}", flush=True)))
    except OSError as error:
        raise ValueError(
            f"--address = {address}, --port = {port}: cannot be bound: {error.strerror or error} (is another simulated "
            "Tello there, or a client that binds all addresses? start this before the client)"
        ) from None
