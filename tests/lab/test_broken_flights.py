"""What flies comes down level and apart when a process dies, when somebody else gives orders, when all are told to end.

Each flight is flown once, and looked at by several tests.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations
from math import dist, hypot
from typing import Any

import pytest
from flockwire_core.domain.airframe import FlightState
from flockwire_core.domain.order import Mission, Order
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.domain.vector import Vector
from flockwire_core.ground.director import Director, Stage
from flockwire_core.ground.fleet import Fleet
from flockwire_core.pilot.reactions import SHUTDOWN
from flockwire_core.process.cores import Core, Start, make_core
from flockwire_core.swarm.model import uav
from flockwire_lab.world import EPOCH, World

Fly = Callable[..., Any]
MOSTLY = ("extended", pytest.param("paper", marks=pytest.mark.long))
KILLED = 4.0  # s after the take-off
DRONES = tuple(uav(i) for i in range(5))


def path(flown: Any, owner: str, begin: float = -99.0, end: float = 1e9) -> list[tuple[float, Vector]]:
    return [(t, pose.position) for t, pose in flown.of("truth", owner, begin, end)]


def first(flown: Any, identity: str, phase: str, begin: float) -> float:
    """Return when a process first reported a phase from `begin` on, s after the take-off."""
    return next(t for t, told, _ in flown.phases(identity, begin) if told == phase)


def closest(flown: Any, begin: float, end: float = 1e9) -> float:
    """Return the smallest distance between two drones, m."""
    frames: dict[int, list[Vector]] = {}
    for owner in DRONES:
        for _, pose in flown.of("truth", owner, begin, end):
            frames.setdefault(pose.stamp, []).append(pose.position)
    return min(dist(a, b) for frame in frames.values() for a, b in combinations(frame, 2))


def is_down(flown: Any, owner: str) -> bool:
    state = flown.of("telemetry", owner)[-1][1].state
    return bool(state is FlightState.GROUNDED and path(flown, owner)[-1][1][2] < 0.02)


class OneShots:
    """`flockwire start`, which ends when all fly; then nobody, until at `again` (Unix ns) it is given once more."""

    def __init__(self, world: World, again: int | None = None, duration: float = 0.0) -> None:
        self._world, self._again, self._duration = world, again, duration
        self._first = self._newest = world.director

    def step(self, fleet: Fleet) -> Mission | None:
        if self._again is not None and fleet.now >= self._again:
            plan = self._world.plan
            self._again, self._newest = None, Director(plan, Order("start"), 0, fleet.now, fleet, self._duration)
        nobody = self._newest is self._first and self._first.stage is Stage.FLYING
        return None if nobody else self._newest.step(fleet)

    @property
    def stage(self) -> Stage:
        return self._newest.stage

    @property
    def failure(self) -> str:
        return self._newest.failure


# The leader's process is killed, and nobody conducts: what follows is the pilots' own doing.


@pytest.fixture(scope="module", params=MOSTLY)
def leaderless(request: pytest.FixtureRequest, fly: Fly) -> Any:
    """Return a flight whose leader is killed: its driver lands it."""

    def prepare(world: World) -> None:
        world.conduct(OneShots(world))  # type: ignore[arg-type]
        world.scheduler.at(EPOCH + 12 * SECOND, lambda _: world.scheduler.stop())

    changes = {"control.law": request.param, "limits.staleness.leader_land": 1.5}
    return fly(changes, {"at": KILLED, "kind": "kill", "process": "leader"}, prepare=prepare)


def test_without_its_leader_every_follower_holds_then_lands_by_itself(leaderless: Any) -> None:
    for i in (1, 2, 3, 4):
        told = [(phase, why) for _, phase, why in leaderless.phases(uav(i), KILLED + 0.2)]
        assert told[:2] == [("formation", ""), ("hold", "the leader is down")]
        assert told[2][0] == "landing"
        assert told[2][1].startswith("the leader lost for 1.5 s")
        assert first(leaderless, uav(i), "hold", KILLED) == pytest.approx(KILLED + 1.0, abs=0.3)
        assert first(leaderless, uav(i), "landing", KILLED) == pytest.approx(KILLED + 2.5, abs=0.4)


def test_no_drone_follows_the_leader_down(leaderless: Any) -> None:
    landing = {i: first(leaderless, uav(i), "landing", KILLED) for i in (1, 2, 3, 4)}
    leader = dict(path(leaderless, "uav0"))
    assert min(p[2] for t, p in leader.items() if t < min(landing.values())) < 0.5  # it was on its way down
    for i, t in landing.items():
        assert min(p[2] for _, p in path(leaderless, uav(i), KILLED, t - 0.1)) > 0.8


def test_they_land_straight_down_level_and_apart(leaderless: Any) -> None:
    assert closest(leaderless, KILLED) >= leaderless.world.swarm.avoidance.drone_safety_distance
    heights = {}
    for i in (1, 2, 3, 4):
        way = path(leaderless, uav(i), first(leaderless, uav(i), "landing", KILLED) + 0.2)
        (x, y, _), (a, b, _) = way[0][1], way[-1][1]
        assert hypot(x - a, y - b) < 0.15
        heights |= {(i, round(t, 2)): p[2] for t, p in way}
    at = KILLED + 3.2
    level = [min((abs(t - at), z) for (j, t), z in heights.items() if j == i)[1] for i in (1, 2, 3, 4)]
    assert max(level) - min(level) < 0.15
    assert 0.2 < max(level) < 0.9


def test_all_land_without_an_order(leaderless: Any) -> None:
    assert all(is_down(leaderless, owner) for owner in DRONES)
    assert "land" not in {m.verb for _, m in leaderless.of("mission", "")}


# An agent is killed: whoever is behind it has no leader estimate, though its neighbour still publishes.


@pytest.fixture(scope="module")
def beheaded(fly: Fly) -> Any:
    """Return a flight in which uav2's agent is killed."""
    return fly(None, {"at": KILLED, "kind": "kill", "process": "uav2"}, duration=20.0)


def test_followers_behind_a_dead_agent_leave_the_formation(beheaded: Any) -> None:
    for identity in ("uav3", "uav4"):
        assert first(beheaded, identity, "hold", KILLED) < KILLED + 2.0
        why = next(why for _, phase, why in beheaded.phases(identity, KILLED) if phase == "hold")
        assert why == "no leader estimate for 1 s"


def test_the_last_in_the_chain_receives_estimates_all_the_time_and_leaves_anyway(beheaded: Any) -> None:
    assert len(beheaded.of("estimate", "uav3", KILLED + 0.5, KILLED + 1.5)) > 90
    origins = {m.origin for _, m in beheaded.of("estimate", "uav3", KILLED + 0.2, KILLED + 1.5)}
    assert len(origins) == 1


def test_followers_before_it_fly_on(beheaded: Any) -> None:
    assert all(phase == "formation" for _, phase, _ in beheaded.phases("uav1", KILLED)[:1])
    assert first(beheaded, "uav1", "landing", KILLED) > KILLED + 2.5


def test_all_are_down_apart_though_one_has_no_agent(beheaded: Any) -> None:
    assert closest(beheaded, KILLED) >= beheaded.world.swarm.avoidance.drone_safety_distance
    assert all(is_down(beheaded, owner) for owner in DRONES)
    assert beheaded.outcome.failure == "uav2 left the formation: silent"


# Other operators.


def test_another_operators_landing_ends_the_flight_well(fly: Fly) -> None:
    at = EPOCH + 5 * SECOND

    def prepare(world: World) -> None:
        own, given = world.director.step, []

        def step(fleet: Fleet) -> Mission | None:
            order = own(fleet)
            if fleet.now < at or given:
                return order
            given.append(fleet.now)
            return Mission(fleet.now, "world", "land")  # which this flight's director does not know of

        world.director.step = step  # type: ignore[method-assign]

    flown = fly(duration=60.0, prepare=prepare)
    assert flown.outcome.failure == ""
    assert flown.outcome.seconds < 15.0
    assert all(is_down(flown, owner) for owner in DRONES)
    assert len({m.stamp for _, m in flown.of("mission", "") if m.verb == "land"}) == 1  # the other's alone


@pytest.fixture(scope="module", params=MOSTLY)
def joined(request: pytest.FixtureRequest, fly: Fly) -> Any:
    """Return a flight in which uav4 lands alone, and is brought back by a second order to start."""

    def prepare(world: World) -> None:
        world.conduct(OneShots(world, EPOCH + 9 * SECOND, 9.0))  # type: ignore[arg-type]

    lost = {"at": 4.0, "kind": "tracker", "drone": 4, "duration": 1.5}
    return fly({"control.law": request.param}, lost, prepare=prepare)


def test_a_second_start_brings_back_who_is_on_the_ground(joined: Any) -> None:
    assert joined.outcome.failure == ""
    phases = [phase for _, phase, _ in joined.phases("uav4", 4.0)]
    assert phases[:4] == ["formation", "hold", "landing", "ready"]
    assert phases[4:8] == ["take-off", "hold", "formation", "landing"] or phases[4:7] == [
        "take-off", "formation", "landing"
    ]  # fmt: skip


def test_a_second_start_leaves_those_that_fly_alone_and_their_formations_time(joined: Any) -> None:
    starts = {m.start for _, m in joined.of("mission", "") if m.verb == "start"}
    assert len(starts) == 1
    land = next(t for t, m in joined.of("mission", "") if m.verb == "land")
    for identity in ("leader", "uav1", "uav2", "uav3"):
        assert {phase for t, phase, _ in joined.phases(identity, 4.0) if t < land} == {"formation"}


def test_who_joins_comes_near_no_drone_and_is_in_its_place(joined: Any) -> None:
    assert closest(joined, 8.0, 18.0) >= joined.world.swarm.avoidance.drone_safety_distance
    land = next(t for t, m in joined.of("mission", "") if m.verb == "land")
    own, leader = (joined.of("truth", owner, land - 0.02, land)[-1][1] for owner in ("uav4", "uav0"))
    start = next(m.start for _, m in joined.of("mission", "") if m.verb == "start")
    offset = joined.world.swarm.build_formation().offset(3, (own.stamp - start) / SECOND)
    assert dist(own.position, [a + b for a, b in zip(leader.position, offset, strict=True)]) < 0.1


@pytest.fixture(scope="module", params=["uav2", "leader"])
def restarted(request: pytest.FixtureRequest, fly: Fly) -> Any:
    """Return a flight in which a pilot is killed, restarted 3 s later, and a second order to start brings all back."""

    def prepare(world: World) -> None:
        world.conduct(OneShots(world, EPOCH + 20 * SECOND, 12.0))  # type: ignore[arg-type]

    faults = {"at": KILLED, "kind": "kill"}, {"at": KILLED + 3.0, "kind": "restart"}
    return fly(None, *(fault | {"process": request.param} for fault in faults), prepare=prepare)


@pytest.mark.long
def test_one_start_brings_all_back_after_a_pilot_was_away_for_three_seconds(restarted: Any) -> None:
    assert restarted.outcome.failure == ""
    land = next(t for t, m in restarted.of("mission", "") if m.verb == "land")
    for pilot in ("leader", "uav1", "uav2", "uav3", "uav4"):
        assert [phase for t, phase, _ in restarted.phases(pilot) if t < land][-1] == "formation", pilot
    assert closest(restarted, KILLED) >= restarted.world.swarm.avoidance.drone_safety_distance
    assert all(is_down(restarted, owner) for owner in DRONES)


def test_a_station_that_is_frozen_for_a_while_lands_no_drone_too_early(fly: Fly) -> None:
    def prepare(world: World) -> None:
        operator = world.processes["operator"]
        world.scheduler.at(EPOCH + 4 * SECOND, operator.freeze)
        world.scheduler.at(EPOCH + 9 * SECOND, operator.thaw)

    flown = fly(duration=10.0, prepare=prepare)
    assert flown.outcome.failure == ""
    assert first(flown, "uav2", "landing", 0.0) == pytest.approx(10.0, abs=0.3)
    assert all(is_down(flown, owner) for owner in DRONES)


# All processes are told to end in flight, as when `up` and its terminal are gone.


class Retired:
    """Tells all cores at `at` s (after the beginning) to end, and looks ten times a second who may."""

    def __init__(self, at: float, dead: str = "") -> None:
        self.at, self.dead = EPOCH + nanoseconds(at), dead
        self.cores: dict[str, Core] = {}
        self.may: list[tuple[int, frozenset[str]]] = []  # when (Unix ns), who may end

    def make(self, start: Start) -> Core:
        self.cores[start.identity] = core = make_core(start)
        return core

    def prepare(self, world: World) -> None:
        def look(_: object) -> None:
            now = world.scheduler.now
            self.may.append((now, frozenset(name for name, core in self.cores.items() if core.may_end(now))))
            world.scheduler.at(now + SECOND // 10, look)

        def retire(_: object) -> None:
            for core in self.cores.values():
                core.retire(world.scheduler.now)
            if self.dead:
                world.processes[self.dead].kill()
            world.processes["operator"].kill()
            look(None)

        world.scheduler.at(self.at, retire)
        world.scheduler.at(self.at + 12 * SECOND, lambda _: world.scheduler.stop())


@pytest.fixture(scope="module", params=MOSTLY)
def retired(request: pytest.FixtureRequest, fly: Fly) -> Any:
    """Return a flight whose processes are told to end, and who may end when."""
    told = Retired(5.0)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("flockwire_lab.world.make_core", told.make)
        return fly({"control.law": request.param}, prepare=told.prepare), told


def test_asked_to_end_all_hold_then_land_apart(retired: Any) -> None:
    flown, _ = retired
    for pilot in ("leader", "uav1", "uav2", "uav3", "uav4"):
        told = [(phase, why) for _, phase, why in flown.phases(pilot, 4.0)]
        assert ("hold", SHUTDOWN) in told
        assert ("landing", SHUTDOWN) in told
        assert told[-1] == ("grounded", SHUTDOWN)
    assert closest(flown, 4.0) >= flown.world.swarm.avoidance.drone_safety_distance
    assert all(is_down(flown, owner) for owner in DRONES)


def test_no_process_may_end_before_what_it_flies_is_down(retired: Any) -> None:
    flown, told = retired
    truth = {owner: {p.stamp: p.position[2] for _, p in flown.of("truth", owner)} for owner in DRONES}
    stamps = sorted(truth["uav0"])
    pilots = dict(zip(DRONES, ("leader", "uav1", "uav2", "uav3", "uav4"), strict=True))
    down_since = max(next(s for s in stamps if s > told.at and truth[owner][s] < 0.01) for owner in DRONES)
    for now, may in told.may:
        for owner, pilot in pilots.items():
            stamp = max(s for s in stamps if s <= now)
            assert pilot not in may or truth[owner][stamp] < 0.02
        assert ("kinematics" in may) == (now >= down_since + SECOND) or abs(now - down_since - SECOND) < SECOND // 5
        assert {"gateway", "recorder"} <= may
    assert told.may[-1][1] >= {*pilots.values(), "kinematics"}


@pytest.mark.long
def test_a_drone_whose_agent_is_dead_is_landed_by_its_driver_when_all_end(fly: Fly) -> None:
    told = Retired(5.0, dead="uav3")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("flockwire_lab.world.make_core", told.make)
        flown = fly(prepare=told.prepare)
    assert all(is_down(flown, owner) for owner in DRONES)
    assert "kinematics" in told.may[-1][1]
    assert "kinematics" not in told.may[0][1]
