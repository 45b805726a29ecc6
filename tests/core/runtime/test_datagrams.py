import asyncio

from flockwire_core.runtime.datagrams import Sockets, serve
from flockwire_twins.kinematics.core import KinematicsCore


def sockets_of(core):
    async def opened():
        async with serve(core) as sockets:
            return sockets

    return asyncio.run(opened())


def test_a_core_that_serves_no_driver_has_no_sockets_so_that_it_receives_commands_where_they_arrive(make_swarm):
    assert sockets_of(KinematicsCore(make_swarm(), 0)) is None


def test_a_core_that_serves_a_driver_has_sockets(make_swarm):
    swarm = make_swarm({"drones.1.airframe": "tello"})
    assert isinstance(sockets_of(KinematicsCore(swarm, 0)), Sockets)
