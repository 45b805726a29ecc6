"""Hosts whose clocks are apart fly one formation: all count by the gateway's clock."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest
from flockwire_core.domain.airframe import FlightState
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.loading import parse_swarm
from flockwire_core.process.cores import Core, Start, make_core
from flockwire_core.swarm.model import Swarm
from flockwire_core.wire.codec import decode
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.status import Status
from flockwire_lab.faults.file import parse_faults
from flockwire_lab.process import Published
from flockwire_lab.world import EPOCH, World

SWARM = Path(__file__).with_name("common_time.toml")
SECONDS = 14.0


def swarm(command_land: float = 1.0, **sim: float) -> Swarm:
    """Return the swarm of four hosts, with another network or other clocks."""
    table = tomllib.loads(SWARM.read_text())
    table.setdefault("limits", {}).setdefault("staleness", {})["command_land"] = command_land
    table["sim"] |= sim
    return parse_swarm(table, SWARM.name)


class Clocks:
    """Watches, from 11 s after the start on, how far the clocks of all processes are from the gateway's."""

    def __init__(self, of: Swarm, faults: str = "") -> None:
        self.statuses: dict[str, Status] = {}
        self.worst: dict[str, float] = {}  # ms
        read = parse_faults(tomllib.loads(faults), Plan(of), "restart") if faults else ()
        self.world = World(of, 3, SECONDS, read, tap=self._tap)

    def _tap(self, published: Published) -> None:
        if published.sample.row.message is not Status:
            return
        status = self.statuses[published.key.owner] = decode(Status, published.sample.payload)
        if published.at >= EPOCH + 11 * SECOND:
            off = abs(published.sample.sent - self.world.processes["gateway"].clock.read(published.at)) / 1e6
            self.worst[status.identity] = max(off, self.worst.get(status.identity, 0.0))


def test_clocks_that_are_apart_and_drift_are_brought_together() -> None:
    clocks = Clocks(swarm())
    outcome = clocks.world.run()
    assert outcome.failure == ""
    assert set(clocks.worst) == {"gateway", "kinematics", "leader", "uav1", "uav2", "uav3", "uav4", "recorder"}
    assert max(clocks.worst.values()) < 2.5
    offsets = {name: status.clock_offset for name, status in clocks.statuses.items()}
    assert offsets["gateway"] == offsets["recorder"] == 0.0
    assert offsets["uav1"] == pytest.approx(offsets["uav2"], abs=0.004)
    assert max(abs(offset) for offset in offsets.values()) > 0.01
    assert all(0.0 <= status.clock_bound < 0.05 for status in clocks.statuses.values())


@pytest.mark.long
def test_no_drone_takes_off_with_a_clock_that_is_not_known_well_enough() -> None:
    clocks = Clocks(swarm(delay=0.08))
    outcome = clocks.world.run()
    assert "still preparing" in outcome.failure
    assert "limits.clock_offset_bound = 0.05 s" in outcome.failure


def test_on_one_host_only_operators_ask_for_the_time() -> None:
    table = tomllib.loads((SWARM.parents[2] / "examples/paper_simulation.toml").read_text())
    plan = Plan(parse_swarm(table, "paper"))
    assert {key.owner for key in plan.keys if key.kind.startswith("time")} == {"operator", "console"}


@pytest.mark.long
def test_a_pilot_restarted_in_flight_knows_the_time_again() -> None:
    fault = '[[faults]]\nat = {}\nkind = "{}"\nprocess = "uav3"\n'
    restart = fault.format(6.0, "kill") + fault.format(6.3, "restart")
    patient = swarm(command_land=3.0, jitter=0.005, delay=0.005)  # until it knows the time its drone hovers
    clocks = Clocks(patient, restart)
    clocks.world.run()
    assert clocks.worst["uav3"] < 2.5


@pytest.mark.parametrize("minutes", [-5, pytest.param(5, marks=pytest.mark.long)])
def test_hosts_whose_clocks_are_minutes_off_fly_as_all_others(minutes: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """A core that began by such a clock would obey orders from before it began, or none for minutes."""
    begun: dict[str, int] = {}

    def noted(start: Start) -> Core:
        begun.setdefault(start.identity, start.now)
        return make_core(start)

    monkeypatch.setattr("flockwire_lab.world.make_core", noted)
    clocks = Clocks(swarm(clock_offset=0.0, jitter=0.005, delay=0.005))
    world = clocks.world
    for identity, process in world.processes.items():
        if world.plan.hosts[identity] != "base":
            process.clock.step(minutes * 60 * SECOND)
    outcome = world.run()
    assert outcome.failure == ""
    assert max(clocks.worst.values()) < 2.5
    assert begun.keys() == world.processes.keys() - {"operator"}
    assert max(abs(now - EPOCH) for now in begun.values()) < 2 * SECOND


@pytest.mark.parametrize("seconds", [-5, pytest.param(5, marks=pytest.mark.long)])
def test_a_driver_that_restarts_without_a_time_server_receives_a_stop_at_once(seconds: int) -> None:
    table = tomllib.loads(SWARM.read_text())
    table["drones"][1] |= {"airframe": "tello", "host": "field"}
    seen: list[Published] = []
    world = World(parse_swarm(table, SWARM.name), 3, SECONDS, tap=seen.append)
    driver, at = world.processes["driver1"], EPOCH + 8 * SECOND
    world.scheduler.at(at, world.processes["gateway"].kill)
    world.scheduler.at(at, driver.kill)
    world.scheduler.at(at, lambda _: driver.clock.step(seconds * SECOND))
    world.scheduler.at(at + SECOND // 10, driver.start)
    world.scheduler.at(at + SECOND // 2, lambda _: world.stop("test"))
    world.run()
    heights = [
        (published.at, published.message.position[2])
        for published in seen
        if published.key == ("truth", "uav1") and published.at > at
    ]
    assert max(z for t, z in heights if t < at + SECOND // 2) > 0.8
    assert max(z for t, z in heights if t > at + nanoseconds(1.3)) < 0.1


@pytest.mark.long
@pytest.mark.parametrize("seconds", [-60, 60])
def test_a_driver_that_learns_the_time_in_flight_flies_on(seconds: int) -> None:
    """The correction of its clock ages no command that it has received."""
    table = tomllib.loads(SWARM.read_text())
    table["drones"][1] |= {"airframe": "tello", "host": "field"}
    seen: list[Published] = []
    world = World(parse_swarm(table, SWARM.name), 3, SECONDS, tap=seen.append)
    driver = world.processes["driver1"]
    world.scheduler.at(EPOCH + 8 * SECOND, driver.kill)
    world.scheduler.at(EPOCH + 8 * SECOND, lambda _: driver.clock.step(seconds * SECOND))
    world.scheduler.at(EPOCH + nanoseconds(8.1), driver.start)
    assert world.run().failure == ""
    states = {
        published.message.state
        for published in seen
        if published.key == ("telemetry", "uav1") and EPOCH + 7 * SECOND < published.at < EPOCH + 12 * SECOND
    }
    assert states == {FlightState.FLYING}
