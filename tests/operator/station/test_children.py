"""How `up` ends its processes: what flies first and in its own time, the recorder last, nobody killed in the air."""

import asyncio
import contextlib
import gc
import os
import signal
import sys
import warnings
from itertools import pairwise
from pathlib import Path

import pytest
from flockwire_operator.station import processes
from flockwire_operator.station.host import Host
from flockwire_operator.station.processes import Children
from flockwire_operator.station.terminal.interrupts import Interrupts
from waiting import SOON, until, wait_until

CHILD = """
import os, pathlib, signal, sys, time
name, folder, landing = sys.argv[1], pathlib.Path(sys.argv[2]), float(sys.argv[3])
def write(what): (folder / f"{name}.{what}").write_text(str(time.monotonic_ns()))
def end(*_):
    write("told")
    time.sleep(landing)
    write("ended")
    os._exit(0)
signal.signal(signal.SIGTERM, end)
(folder / f"{name}.pid").write_text(str(os.getpid()))
write("runs")
time.sleep(60)
os._exit(1)
"""


class Family:
    """Children that take `landing` s to end, once told, and leave a note of each moment in `folder`."""

    def __init__(self, plan, folder, monkeypatch):
        self.folder, self.landing, self.interrupted = folder, {}, Interrupts()
        monkeypatch.setattr(Host, "command_line", self.command_line)
        self.children = Children(Host(plan, Path("s.toml"), "localhost", folder, Path("k")))

    def command_line(self, identity, took_off):
        return [sys.executable, "-SEc", CHILD, identity, str(self.folder), str(self.landing.get(identity, 0.0))]

    async def start(self, *identities):
        for identity in identities:
            self.children.start(identity)
        await until(lambda: all(self.when(identity, "runs") for identity in identities))

    def when(self, identity, what):
        """Return when it happened, ns; 0 when it did not."""
        note = self.folder / f"{identity}.{what}"
        return int(note.read_text() or 0) if note.exists() else 0


@pytest.fixture
def folder(tmp_path):
    """Return a folder; the children that left their numbers there are ended with the test."""
    yield tmp_path
    for note in tmp_path.glob("*.pid"):
        with contextlib.suppress(ProcessLookupError):
            os.kill(int(note.read_text()), signal.SIGKILL)


@pytest.fixture
def family(make_plan, folder, monkeypatch):
    return Family(make_plan({"network.mode": "router"}), folder, monkeypatch)


def test_what_flies_ends_first_then_each_rank_after_the_one_before(family):
    family.landing = {"uav1": 0.2, "kinematics": 0.3}
    everybody = ("recorder", "gateway", "router", "kinematics", "uav1", "leader")

    async def run():
        await family.start(*everybody)
        async with asyncio.timeout(SOON):
            await family.children.end(family.interrupted)

    asyncio.run(run())
    flyers = ("uav1", "leader", "kinematics")
    assert max(family.when(i, "ended") for i in flyers) < family.when("router", "told")
    for one, other in pairwise(("router", "gateway", "recorder")):
        assert family.when(one, "ended") < family.when(other, "told")


def test_what_flies_has_its_time_to_land_and_the_others_have_not(family, monkeypatch):
    monkeypatch.setattr(processes, "GRACE", 0.1)
    family.landing = {"uav1": 0.6, "gateway": 30.0}

    async def run():
        await family.start("uav1", "gateway")
        async with asyncio.timeout(SOON):
            await family.children.end(family.interrupted)

    asyncio.run(run())
    assert family.when("uav1", "ended")
    assert family.when("gateway", "told")
    assert not family.when("gateway", "ended")


def test_a_recorder_has_its_time_to_complete_the_trace(family, monkeypatch):
    monkeypatch.setattr(processes, "GRACE", 0.1)
    family.landing = {"recorder": 0.6}

    async def run():
        await family.start("recorder")
        async with asyncio.timeout(SOON):
            await family.children.end(family.interrupted)

    asyncio.run(run())
    assert family.when("recorder", "ended")


def test_a_recorder_that_hangs_is_ended_at_last(family, monkeypatch):
    monkeypatch.setattr(processes, "FILING", 0.2)
    family.landing = {"recorder": 30.0}

    async def run():
        await family.start("recorder")
        async with asyncio.timeout(SOON):
            await family.children.end(family.interrupted)

    asyncio.run(run())
    assert family.when("recorder", "told")
    assert not family.when("recorder", "ended")


def test_what_does_not_land_in_its_time_is_ended_at_last(family, monkeypatch):
    monkeypatch.setattr(processes, "LANDING_TIME", 0.2)
    family.landing = {"uav1": 30.0}

    async def run():
        await family.start("uav1", "recorder")
        async with asyncio.timeout(SOON):
            await family.children.end(family.interrupted)

    asyncio.run(run())
    assert not family.when("uav1", "ended")
    assert family.when("recorder", "ended")


def test_a_frozen_one_is_asked_to_end_anyway(family):
    async def run():
        await family.start("uav1")
        family.children.signal("uav1", signal.SIGSTOP)
        async with asyncio.timeout(SOON):
            await family.children.end(family.interrupted)

    asyncio.run(run())
    assert family.when("uav1", "ended")


def test_a_second_interrupt_leaves_flying_drones_and_kills_no_process(family):
    family.landing = {"uav1": 1.0}

    async def run():
        await family.start("uav1", "kinematics", "recorder")
        family.interrupted.count = 1
        asyncio.get_running_loop().call_later(0.2, setattr, family.interrupted, "count", 2)
        async with asyncio.timeout(SOON):
            await family.children.end(family.interrupted)
        assert not family.when("uav1", "ended")
        assert not family.when("recorder", "told")  # it ends last, by itself

    asyncio.run(run())


def test_a_second_interrupt_leaves_the_gateway_of_other_hosts_drones(family):
    async def run():
        await family.start("gateway", "recorder")
        family.interrupted.count = 2
        async with asyncio.timeout(SOON):
            await family.children.end(family.interrupted)
        assert not family.when("gateway", "told")  # it ends once no drone needs its poses

    asyncio.run(run())


def test_a_child_outlives_the_object_that_started_it_and_every_loop(family):
    async def run():
        await family.start("uav1")
        family.interrupted.count = 2
        await family.children.end(family.interrupted)

    family.landing = {"uav1": 0.5}
    family.children.start("recorder")  # there is no loop that could own it
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        asyncio.run(run())
        del family.children
        gc.collect()
    assert not said
    wait_until(lambda: family.when("uav1", "ended") and family.when("recorder", "runs"))
    assert not family.when("recorder", "told")


STATION = """
import asyncio, sys
from pathlib import Path
from flockwire_core.loading import load_swarm
from flockwire_core.wire.plan import Plan
from flockwire_operator.station.host import Host
from flockwire_operator.station.processes import Children
from flockwire_operator.station.terminal.interrupts import Interrupts
out = Path({out!r})
Host.command_line = lambda _, identity, *__: [sys.executable, "-SEc", {child!r}, identity, str(out), "1.0"]
async def run():
    children = Children(Host(Plan(load_swarm(Path({swarm!r}))), Path("s"), "localhost", out, Path("k")))
    for identity in ("uav1", "recorder"):
        children.start(identity)
    while not all((out / f"{{i}}.runs").exists() for i in ("uav1", "recorder")):
        await asyncio.sleep(0.01)
    interrupted = Interrupts()
    interrupted.count = 2
    await children.end(interrupted)
asyncio.run(run())
"""


def test_what_a_station_leaves_in_the_air_outlives_its_process(folder, request):
    swarm = str(request.config.rootpath / "examples" / "paper_simulation.toml")
    text = STATION.format(out=str(folder), child=CHILD, swarm=swarm)

    async def run():
        station = await asyncio.create_subprocess_exec(sys.executable, "-c", text)
        assert await asyncio.wait_for(station.wait(), 3 * SOON) == 0
        await until((folder / "uav1.ended").exists)

    asyncio.run(run())
    assert not (folder / "recorder.told").exists()
