"""`conduct`: the flight of processes that run already, its keys and interrupts."""

import asyncio
import os

import pytest
from flockwire_core.domain.order import Stop
from flockwire_core.domain.time import SECOND
from flockwire_core.ground import director
from flockwire_core.wire.phase import Phase
from flockwire_operator.station import conduct as conducting
from flockwire_operator.station import operator
from simulated_pilots import SimulatedSwarm

TICK = 0.005  # s between two looks


@pytest.fixture
def swarm(make_plan, monkeypatch):
    """Return the swarm that `conduct` finds."""
    found = SimulatedSwarm(make_plan())

    async def connected(*_):
        return found

    monkeypatch.setattr(conducting, "connected", connected)
    monkeypatch.setattr(operator, "POLL_PERIOD", TICK)
    monkeypatch.setattr(director, "LEAD_TIME", SECOND // 50)
    return found


def conduct(swarm, happens=None, duration=0.0):
    """Fly, while `happens` does; returns why the flight failed."""

    async def run():
        flight = asyncio.create_task(conducting.conduct(swarm.plan, None, duration, None, headless=True))
        beside = asyncio.create_task(happens()) if happens is not None else None
        async with asyncio.timeout(10):
            failure = await flight
        if beside is not None:
            await beside
        return failure

    return asyncio.run(run())


async def until(swarm, phase):
    while {pilot.phase for pilot in swarm.pilots.values()} != {phase}:  # noqa: ASYNC110
        await asyncio.sleep(TICK)


def test_a_flight_from_take_off_to_landing(swarm):
    assert conduct(swarm, duration=0.2) == ""
    assert swarm.orders == ["takeoff", "start", "land"]


def test_two_presses_of_s_stop_the_motors(swarm, terminal):
    async def press():
        await until(swarm, Phase.FORMATION)
        os.write(terminal[0], b"ss")

    assert conduct(swarm, press) == "emergency stop"
    assert {pilot.phase for pilot in swarm.pilots.values()} == {Phase.STOPPED}
    assert any(isinstance(order, Stop) for order in swarm.published)


def test_keys_hold_fly_the_formation_and_land(swarm, terminal):
    async def press():
        await until(swarm, Phase.FORMATION)
        for key, phase in ((b"h", Phase.HOLD), (b"f", Phase.FORMATION), (b"l", Phase.READY)):
            os.write(terminal[0], key)
            await until(swarm, phase)

    assert conduct(swarm, press) == ""
    assert swarm.orders == ["takeoff", "start", "hold", "start", "land"]
