"""Hosts whose clocks are apart fly one formation: all count by the gateway's clock."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest
from flockwire.flight.faults import parse_faults
from flockwire.loading import parse_swarm
from flockwire.nanoseconds import BILLION
from flockwire.swarm.model import Swarm
from flockwire.wire.plan import Plan
from flockwire.wire.status import Status
from flockwire_sim.process import MakeCore, Published
from flockwire_sim.world import EPOCH, World

SWARM = Path(__file__).parents[2] / "bench/common_time.toml"
SECONDS = 14.0


def swarm(**sim: float) -> Swarm:
    """Return the swarm of four hosts, with another network or other clocks."""
    table = tomllib.loads(SWARM.read_text())
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
        status = self.statuses[published.key.owner] = Status.decode(published.sample.payload)
        if published.at >= EPOCH + 11 * BILLION:
            off = abs(published.sent - self.world.processes["gateway"].clock.read(published.at)) / 1e6
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


def test_nobody_takes_off_with_a_clock_that_is_not_known_well_enough() -> None:
    clocks = Clocks(swarm(delay=0.08))
    outcome = clocks.world.run()
    assert "still preparing" in outcome.failure
    assert "limits.clock_offset_bound = 0.05 s" in outcome.failure


def test_one_host_asks_for_no_time() -> None:
    table = tomllib.loads((SWARM.parents[1] / "swarms/paper_simulation.toml").read_text())
    plan = Plan(parse_swarm(table, "paper"))
    assert not [key for key in plan.keys if key.kind.startswith("time")]


def test_a_pilot_restarted_in_flight_knows_the_time_again() -> None:
    fault = '[[faults]]\nat = {}\nkind = "{}"\nprocess = "uav3"\n'
    restart = fault.format(6.0, "kill") + fault.format(6.3, "restart")
    clocks = Clocks(swarm(jitter=0.005, delay=0.005), restart)
    clocks.world.run()
    assert clocks.worst["uav3"] < 2.5


@pytest.mark.parametrize("minutes", [-5, 5])
def test_hosts_whose_clocks_are_minutes_off_fly_as_all_others(minutes: int) -> None:
    """A core that began by such a clock would obey orders from before it began, or none for minutes."""
    clocks = Clocks(swarm(clock_offset=0.0, jitter=0.005, delay=0.005))
    world, begun = clocks.world, dict[str, int]()

    def noted(identity: str, make: MakeCore) -> MakeCore:
        return lambda now, starts: make(begun.setdefault(identity, now), starts)

    for identity, process in world.processes.items():
        process._make_core = noted(identity, process._make_core)
        if world.plan.hosts[identity] != "base":
            process.clock.step(minutes * 60 * BILLION)
    outcome = world.run()
    assert outcome.failure == ""
    assert max(clocks.worst.values()) < 2.5
    assert max(abs(now - EPOCH) for now in begun.values()) < 2 * BILLION
