"""The gateway's process: the shell around its core, and the connection of its source, if it has one."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable, Mapping
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from pathlib import Path
from typing import Any, cast

from flockwire_core.process.cores import Core
from flockwire_core.runtime.job import Job
from flockwire_core.runtime.shell import run_core

from flockwire_mocap.core import GatewayCore
from flockwire_mocap.natnet.client import NatNetClient
from flockwire_mocap.natnet.source import NatNetSource
from flockwire_mocap.persistent import PersistentConnection
from flockwire_mocap.qualisys.client import QualisysClient
from flockwire_mocap.qualisys.source import QualisysSource
from flockwire_mocap.replay.source import ReplaySource, read_poses
from flockwire_mocap.ros.client import RosClient
from flockwire_mocap.ros.source import RosSource
from flockwire_mocap.vicon.client import ViconClient
from flockwire_mocap.vicon.source import ViconSource
from flockwire_mocap.vrpn.client import VrpnClient
from flockwire_mocap.vrpn.source import VrpnSource

Drained = Callable[[], None]
CLIENTS: Mapping[type, Callable[[Any, Drained], PersistentConnection[Any] | RosClient]] = {
    VrpnSource: VrpnClient,
    QualisysSource: QualisysClient,
    ViconSource: ViconClient,
    RosSource: RosClient,
}


@asynccontextmanager
async def _natnet(source: NatNetSource, drained: Drained) -> AsyncIterator[None]:
    interface = source.session.table.interface
    client = NatNetClient(source.session, source.arrived, drained)
    try:
        await client.open()
    except OSError as error:
        raise OSError(f"gateway.natnet.interface = {interface!r}: {error.strerror or error}") from error
    try:
        yield
    finally:
        client.close()


@asynccontextmanager
async def _kept(client: PersistentConnection[Any] | RosClient) -> AsyncIterator[None]:
    client.open()
    try:
        yield
    finally:
        await client.close()


@asynccontextmanager
async def _replay(source: ReplaySource) -> AsyncIterator[None]:
    path = Path(source.table.trace)
    try:
        source.load(await asyncio.to_thread(read_poses, path, source.swarm))
    except OSError as error:
        raise OSError(f"gateway.replay.trace = {source.table.trace!r}: {error.strerror or error}") from error
    yield


def feed(core: Core, step: Callable[[], None]) -> AbstractAsyncContextManager[None] | None:
    """Return the connection of the core's source; it calls `step` when a frame is complete."""
    source = cast("GatewayCore", core).source

    def drained() -> None:
        if source.complete():
            step()

    match source:
        case NatNetSource():
            return _natnet(source, drained)
        case ReplaySource():
            return _replay(source)
    client = CLIENTS.get(type(source))
    return None if client is None else _kept(client(source, drained))


async def run(job: Job) -> None:
    """Run the gateway until it must end; raises OSError if its source cannot be opened."""
    await run_core(job, feed)
