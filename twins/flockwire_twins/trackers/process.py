"""The process of the simulated tracker: the shell around its core, and the server of the tracker's protocol."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from random import Random
from typing import cast

from flockwire_core import clock
from flockwire_core.domain.pose import Pose
from flockwire_core.process.cores import Start
from flockwire_core.runtime.job import Job
from flockwire_core.runtime.shell import run_core
from flockwire_core.swarm.gateway import Gateway, Twin
from flockwire_core.swarm.model import Swarm, uav
from flockwire_core.wire.keys import Key
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.processes import TRACKER
from flockwire_mocap.natnet.packets import GROUP, version_of

from flockwire_twins.trackers.core import TwinCore
from flockwire_twins.trackers.natnet import announced
from flockwire_twins.trackers.natnet_server import NatNetServer
from flockwire_twins.trackers.qualisys import QtmServer
from flockwire_twins.trackers.ros import RosServer
from flockwire_twins.trackers.vrpn import VrpnServer

Server = NatNetServer | VrpnServer | QtmServer | RosServer


def _server(gateway: Gateway, names: dict[int, str]) -> Server:
    if gateway.source == "vrpn":
        return VrpnServer(names.values(), gateway.vrpn.server, gateway.vrpn.port)
    if gateway.source == "qualisys":
        return QtmServer(names.values(), gateway.qualisys.server, gateway.qualisys.port)
    if gateway.from_ros:
        return RosServer(names.values(), gateway.ros)
    table, twin = gateway.natnet, gateway.twin or Twin()
    info = announced(version_of(twin.version), table.multicast, table.data_port, table.group or GROUP)
    return NatNetServer(info, names, table.server, table.command_port)


@asynccontextmanager
async def _served(core: TwinCore) -> AsyncIterator[None]:
    gateway = core.swarm.gateway
    server = _server(gateway, core.names)
    try:
        await server.open()
    except OSError as error:
        where = f"gateway.{gateway.source}.server = {getattr(gateway, gateway.source).server!r}"
        raise OSError(f"{where}: cannot serve there: {error.strerror or error}") from error
    core.serve(server.publish)
    try:
        yield
    finally:
        core.serve(None)
        server.close()


async def run(job: Job) -> None:
    """Serve until the process is to end; raises OSError if the port is taken, or the address is not of this host."""
    await run_core(job, lambda core, _: _served(cast("TwinCore", core)))


def serve_alone(swarm: Swarm, protocol: str) -> None:
    """Serve the bodies of `swarm` at their starts, until it is interrupted.

    Raises OSError if the port is taken, or the address is not of this host.
    """
    gateway = swarm.gateway
    served = gateway.model_copy(update={"source": protocol, "twin": gateway.twin or Twin()})
    plan = Plan(swarm.tracked_by(served))
    core = TwinCore(Start(plan, TRACKER.kind, clock.now(), Random(gateway.seed)))  # noqa: S311  (noise)
    asyncio.run(_stand(core))


async def _stand(core: TwinCore) -> None:
    async with _served(core):
        server = getattr(core.swarm.gateway, core.swarm.gateway.source).server
        print(f"flockwire: serves {len(core.names)} bodies at {server}, Ctrl-C ends it", flush=True)
        while True:
            now = clock.now()
            for i in core.swarm.tracked:
                core.receive(Key("truth", uav(i)), Pose(now, core.swarm.frame, core.swarm.drone(i).start), now)
            core.step(now)
            await asyncio.sleep(core.period)
