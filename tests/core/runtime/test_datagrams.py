import asyncio
from types import SimpleNamespace

from flockwire_core.runtime.datagrams import feed
from flockwire_twins.kinematics.core import KinematicsCore


def fed(core):
    shell = SimpleNamespace(stepper=SimpleNamespace(time=int, flush=None))
    return feed(core, shell), shell.stepper


def test_a_core_that_serves_no_driver_has_no_sockets_so_that_it_receives_commands_where_they_arrive(make_swarm):
    assert fed(KinematicsCore(make_swarm(), 0))[0] is None


def test_a_core_that_serves_a_driver_has_sockets(make_swarm):
    swarm = make_swarm({"drones.1.airframe": "tello"})
    sockets, stepper = fed(KinematicsCore(swarm, 0))

    async def opened():
        async with sockets:
            return stepper.flush

    assert callable(asyncio.run(opened()))
