"""Whole flights in virtual time: what the network, the clocks and the faults do to them."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from itertools import groupby

import pytest
from flockwire_agent.extended_law import ExtendedLaw
from flockwire_core.domain.airframe import FlightState
from flockwire_core.domain.time import SECOND
from flockwire_core.law import Decision, LawSettings, Observation
from flockwire_core.swarm.model import Swarm
from flockwire_core.wire.plan import Plan
from flockwire_lab.faults.injection import unable
from flockwire_lab.faults.kinds import Kill
from flockwire_lab.process import Published

Fly = Callable[..., object]


def height(flown, owner: str, at: float) -> float:
    return flown.of("truth", owner, -99.0, at)[-1][1].position[2]


def formation_error(flown, follower: int, t: float) -> float:
    """Return how far a follower's truth is from its place round the leader's truth, m, t s after the take-off."""
    swarm: Swarm = flown.world.swarm
    start = next(m for _, m in flown.of("mission", "") if m.verb == "start")
    own, leader = (flown.of("truth", f"uav{i}", t - 0.02, t)[-1][1] for i in (follower, 0))
    seconds = (own.stamp - start.start) / SECOND
    h = swarm.build_formation().offset(follower - 1, seconds)
    return math.dist(own.position, [a + b for a, b in zip(leader.position, h, strict=True)])


@pytest.fixture(scope="module")
def plain(fly: Fly) -> object:
    """Return a flight in which nothing is wrong."""
    return fly()


def test_a_flight_takes_off_settles_and_lands(plain) -> None:
    flown = plain
    assert flown.outcome.failure == ""
    assert [verb for verb, _ in groupby(m.verb for _, m in flown.of("mission", ""))] == ["takeoff", "start", "land"]
    assert max(formation_error(flown, i, 7.5) for i in (1, 2, 3, 4)) < 0.05
    assert [phase for _, phase, _ in flown.phases("uav2")][-1] in ("landing", "grounded", "ready")
    landed = flown.of("telemetry", "uav4")[-1][1]
    assert landed.state is FlightState.GROUNDED


def test_every_process_says_what_the_key_table_has_it_say_and_at_its_rate(plain) -> None:
    flown = plain
    for key in ("truth", "pose", "nearby", "estimate", "command"):
        assert len(flown.of(key, "uav2", 1.0, 7.0)) == pytest.approx(600, abs=3), key
    for owner in ("gateway", "kinematics", "leader", "uav1", "recorder"):
        assert len(flown.of("status", owner, 1.0, 7.0)) == pytest.approx(60, abs=4), owner


def test_clocks_that_are_off_are_seen_in_the_stamps(fly: Fly) -> None:
    flown = fly({"sim.clock_offset": 0.02, "sim.clock_drift": 1e-4}, seed=3)
    offsets: dict[str, set[int]] = {}
    for _, published, _ in flown.published:
        assert isinstance(published, Published)
        offsets.setdefault(published.sample.publisher.hex(), set()).add(published.sample.sent - published.at)
    assert len({min(values) for values in offsets.values()}) >= 7
    assert all(abs(value) < 0.023 * SECOND for values in offsets.values() for value in values)
    assert flown.outcome.failure == ""


def test_a_follower_of_a_killed_agent_holds_then_lands_and_then_all_do(fly: Fly) -> None:
    rungs = {"limits.staleness.estimates_hold": 0.5, "limits.staleness.estimates_land": 1.5}
    flown = fly(rungs, {"at": 4.0, "kind": "kill", "process": "uav2"}, duration=30.0)
    assert not flown.of("command", "uav2", 4.001)
    told = flown.phases("uav3", 4.0)
    holding = next(t for t, phase, why in told if phase == "hold")
    landing = next(t for t, phase, why in told if phase == "landing")
    assert holding - 4.0 == pytest.approx(0.5, abs=0.15)
    assert landing - 4.0 == pytest.approx(1.5, abs=0.15)
    assert "uav3 left the formation: leader estimate lost" in flown.outcome.failure
    assert all(height(flown, f"uav{i}", 99.0) < 0.05 for i in (0, 1, 2, 3, 4))
    # The driver of the dead agent's drone hovers, then lands it.
    assert height(flown, "uav2", 4.5) > 0.9
    assert height(flown, "uav2", 4.0 + 1.0 + 3.0) < 0.05


def test_a_restarted_process_has_no_state_and_the_flight_continues(fly: Fly) -> None:
    flown = fly(None, {"at": 4.0, "kind": "restart", "process": "gateway"}, duration=12.0)
    assert flown.outcome.failure == ""
    assert not flown.of("pose", "uav2", 4.01, 4.49)
    publishers = {
        published.sample.publisher for _, published, _ in flown.published if published.key == ("pose", "uav2")
    }
    assert len(publishers) == 2
    assert formation_error(flown, 2, 11.5) < 0.05


def test_a_restarted_agent_finds_itself_in_flight(fly: Fly) -> None:
    flown = fly(None, {"at": 4.0, "kind": "restart", "process": "uav2"}, duration=12.0)
    told = [phase for _, phase, _ in flown.phases("uav2", 4.5)]
    assert told[0] == "grounded"  # it knows nothing yet
    assert "formation" in told
    assert formation_error(flown, 2, 11.5) < 0.05
    assert flown.outcome.failure == ""


def test_a_frozen_agent_is_silent_then_continues_and_counts_what_it_missed(fly: Fly) -> None:
    flown = fly(None, {"at": 4.0, "kind": "freeze", "process": "uav3", "duration": 0.7}, duration=9.0)
    assert not flown.of("command", "uav3", 4.005, 4.695)
    assert flown.of("command", "uav3", 4.7, 4.75)
    frozen = flown.of("status", "uav3", 5.0, 5.2)[0][1]
    assert frozen.skipped >= 60
    assert flown.outcome.failure == ""


def test_a_process_is_frozen_until_the_last_freeze_of_it_ends(fly: Fly) -> None:
    freezes = [
        {"at": at, "kind": "freeze", "process": "uav3", "duration": d} for at, d in ((4.0, 0.4), (4.1, 0.1), (4.3, 0.3))
    ]
    flown = fly(None, *freezes, duration=6.0)
    assert not flown.of("command", "uav3", 4.005, 4.595)
    assert flown.of("command", "uav3", 4.6, 4.65)


def test_a_frozen_gateway_makes_every_agent_stop(fly: Fly) -> None:
    flown = fly(None, {"at": 5.0, "kind": "freeze", "process": "gateway", "duration": 0.5}, duration=9.0)
    commands = flown.of("command", "uav1", 5.2, 5.45)
    assert commands
    assert all(message.velocity == (0.0, 0.0, 0.0) for _, message in commands)
    assert flown.outcome.failure == ""


def test_a_swarm_with_a_router_flies_without_it(fly: Fly, make_plan: Callable[..., Plan]) -> None:
    flown = fly({"network.mode": "router"}, duration=4.0)
    assert flown.outcome.failure == ""
    (line,) = unable(make_plan({"network.mode": "router"}), "faults.0", Kill(at=1.0, kind="kill", process="router"))
    assert line.startswith("faults.0.process = 'router': ")


def test_a_cut_edge_drops_only_the_receiver(fly: Fly) -> None:
    flown = fly(None, {"at": 4.0, "kind": "cut", "from": "uav3", "to": "uav4", "duration": 2.0}, duration=10.0)
    assert any(phase == "hold" for _, phase, _ in flown.phases("uav4", 4.0))
    assert all(phase != "hold" for t, phase, _ in flown.phases("uav3", 4.0) if t < 9.9)
    assert formation_error(flown, 4, 9.5) < 0.1
    assert flown.outcome.failure == ""


def test_a_partition_cuts_both_directions(fly: Fly) -> None:
    flown = fly(None, {"at": 4.0, "kind": "partition", "processes": ["uav4"], "duration": 0.6}, duration=8.0)
    missed = [t for t, published, _ in flown.published if published.key == ("command", "uav4") and 4.2 < t < 4.5]
    assert missed  # it still speaks
    ages = [message.command_age for _, message in flown.of("telemetry", "uav4", 4.4, 4.6)]
    assert max(ages) > 0.3  # but is not received


def test_one_above_another_does_not_land_on_it_when_the_one_below_gets_no_commands(fly: Fly) -> None:
    """Found by draws: all lose their poses as they land; drivers below hover until `command_land`."""
    places = ((0.0, 0.0, 0.8), (1.4, 0.0, 0.0), (1.4, 0.0, 0.8), (-1.4, 0.3, 0.4))
    rows = ["t,drone,x,y,z", *(f"{t},{i},{x},{y},{z}" for i, (x, y, z) in enumerate(places, 1) for t in (0, 1000))]
    pairs = {
        "control.law": "extended",
        "formation": {"kind": "key_frames", "file": "pairs.csv", "frames": "\n".join(rows)},
        "leader.trajectory.velocity": [0.0, 0.0, 0.0],
    }
    alone = {"at": 8.0, "kind": "partition", "processes": ["kinematics", "uav3"], "duration": 3.0}
    flown = fly(pairs, alone)
    at = {owner: {m.stamp: m.position for _, m in flown.of("truth", owner, 7.0)} for owner in ("uav2", "uav3")}
    assert (
        min(math.dist(at["uav2"][stamp], at["uav3"][stamp]) for stamp in at["uav2"] if at["uav2"][stamp][2] > 0) > 0.5
    )


def test_a_slow_link_makes_estimates_old(fly: Fly) -> None:
    slow = {"at": 4.0, "kind": "link", "from": "uav1", "to": "uav2", "duration": 2.0, "delay": 0.1}
    flown = fly(None, slow, duration=8.0)
    before = flown.of("status", "uav2", 3.0, 4.0)[-1][1].report.estimate_age
    during = flown.of("status", "uav2", 5.0, 5.9)[-1][1].report.estimate_age
    after = flown.of("status", "uav2", 6.5, 7.5)[-1][1].report.estimate_age
    assert during == pytest.approx(before + 0.1, abs=0.02)
    assert after == pytest.approx(before, abs=0.02)


def test_a_drone_that_the_tracker_loses_stops_and_lands(fly: Fly) -> None:
    flown = fly(None, {"at": 4.0, "kind": "tracker", "drone": 3, "duration": 2.0}, duration=20.0)
    assert not flown.of("pose", "uav3", 4.02, 5.98)
    assert flown.of("pose", "uav3", 6.02, 6.1)
    assert any(phase == "landing" and "own pose lost" in why for _, phase, why in flown.phases("uav3", 4.0))
    assert "uav3 left the formation: own pose lost" in flown.outcome.failure


def test_a_drone_lost_in_take_off_does_not_keep_the_others_in_the_air(fly: Fly) -> None:
    flown = fly(None, {"at": 0.8, "kind": "tracker", "drone": 4, "duration": 1.3})
    assert flown.outcome.failure.startswith("uav4 did not take off: own pose lost")
    assert flown.outcome.seconds < 8.0


def test_a_noise_burst_is_in_the_poses_while_it_lasts(fly: Fly) -> None:
    flown = fly(None, {"at": 4.0, "kind": "noise", "noise": 0.02, "duration": 1.0}, duration=7.0)

    def spread(begin: float, end: float) -> float:
        truth = {m.stamp: m.position for _, m in flown.of("truth", "uav1")}
        errors = [m.position[2] - truth[m.stamp][2] for _, m in flown.of("pose", "uav1", begin, end)]
        return math.sqrt(sum(e * e for e in errors) / len(errors))

    assert spread(3.0, 3.9) == 0.0
    assert spread(4.05, 4.95) == pytest.approx(0.02, rel=0.3)
    assert spread(5.1, 6.0) == 0.0


def test_a_clock_step_shows_in_what_the_process_sends(fly: Fly) -> None:
    flown = fly(None, {"at": 4.0, "kind": "clock", "process": "uav1", "step": 0.05}, duration=7.0)
    off = [
        published.sample.sent - published.at
        for t, published, _ in flown.published
        if published.key == ("command", "uav1") and t > 4.1
    ]
    assert set(off) == {50_000_000}


def test_an_airframe_that_answers_late_errs_more(fly: Fly) -> None:
    flown = fly({"control.law": "extended"}, {"at": 5.0, "kind": "lag", "drone": 2, "lag": 0.3}, duration=10.0)
    assert formation_error(flown, 2, 9.5) > 3 * formation_error(flown, 2, 4.9)


def test_an_airframe_that_fails_falls(fly: Fly) -> None:
    flown = fly(None, {"at": 5.0, "kind": "failure", "drone": 2}, duration=9.0)
    assert height(flown, "uav2", 4.9) > 0.9
    assert height(flown, "uav2", 5.8) == 0.0
    state = flown.of("telemetry", "uav2", 5.8, 6.5)[-1][1].state
    assert state is FlightState.STOPPED


def test_a_lossy_jittering_network_is_survived(fly: Fly) -> None:
    changes = {"sim.delay": 0.005, "sim.jitter": 0.005, "sim.loss": 0.05, "sim.reordering": 0.05}
    flown = fly(changes, duration=10.0)
    assert flown.outcome.failure == ""
    assert max(formation_error(flown, i, 9.5) for i in (1, 2, 3, 4)) < 0.15
    rejected = dict(flown.of("status", "uav2", 8.0)[-1][1].rejected)
    assert any("older than the last" in name or "repeated" in name for name in rejected)


class FailingInFlight(ExtendedLaw):
    """Fails in drone 4, two seconds into the formation."""

    def __init__(self, settings: LawSettings) -> None:
        super().__init__(settings)
        self.number = settings.number

    def step(self, seen: Observation) -> Decision:
        if self.number == 4 and seen.place is not None and seen.t > 2.0:
            raise ArithmeticError("no way")
        return super().step(seen)


def test_a_drone_whose_law_raises_in_flight_holds_its_place_and_reports_why(
    fly: Fly, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "my_failing_law", sys.modules[__name__])
    flown = fly({"control.law": "my_failing_law:FailingInFlight"}, duration=6.0)
    flying = next(t for t, phase, _ in flown.phases("uav4") if phase == "formation")
    raised = FailingInFlight.step.__code__.co_firstlineno + 2
    assert [told[1:] for told in flown.phases("uav4", flying)[:2]] == [
        ("formation", ""),
        ("hold", f"the law failed: ArithmeticError: no way (test_flights.py:{raised})"),
    ]
    assert [phase for _, phase, _ in flown.phases("uav4", flying)[2:3]] == ["landing"]  # no try before the next order
    held = [m.position for _, m in flown.of("truth", "uav4", flying + 3.0, 5.9)]
    assert max(math.dist(place, held[0]) for place in held) < 0.02
    assert flown.of("status", "uav4")[-1][1].report.phase in ("landing", "grounded", "ready")
    assert max(formation_error(flown, i, 5.9) for i in (1, 2, 3)) < 0.01
    assert flown.outcome.failure == ""


class FailingAtLength(ExtendedLaw):
    """Fails with more text than a status holds."""

    def step(self, seen: Observation) -> Decision:
        if seen.place is not None and seen.t > 2.0:
            raise ArithmeticError("no way " * 100)
        return super().step(seen)


def test_a_long_text_arrives_as_its_bytes_say(fly: Fly, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "my_failing_law", sys.modules[__name__])
    flown = fly({"control.law": "my_failing_law:FailingAtLength"}, duration=6.0)
    assert any("no way" in why and why.endswith("...") for _, _, why in flown.phases("uav4"))
    assert flown.differing() == {}


def test_what_is_received_is_what_its_bytes_say(plain) -> None:
    """In virtual time messages arrive as they were sent, which is no difference."""
    assert plain.differing() == {}


def test_drones_take_off_from_tables_of_any_height_and_climb_as_all_others(fly: Fly) -> None:
    tables = {0: 0.0, 1: -0.2, 2: 0.5, 3: 0.96, 4: 1.2}  # m
    places = ((0.0, 0.0), (-0.7, 2.6), (2.9, -0.8), (0.6, -2.3), (-2.8, 0.9))
    starts = {f"drones.{i}.start": [*places[i], z] for i, z in tables.items()}
    flown = fly(starts | {"drones.2.airframe": "tello", "formation.rate": 0.2}, duration=6.0)
    assert flown.outcome.failure == ""
    for i, z in tables.items():
        states = [message.state for _, message in flown.of("telemetry", f"uav{i}")]
        assert states[0] is states[-1] is FlightState.GROUNDED
        assert FlightState.FLYING in states
        off = next(t for t, phase, _ in flown.phases("leader" if i == 0 else f"uav{i}") if phase == "hold")
        ((_, truth), *_) = flown.of("truth", f"uav{i}", off)
        assert truth.position[2] == pytest.approx(z + 1.0, abs=0.1)
        (*_, (_, end)) = flown.of("truth", f"uav{i}")
        assert end.position[2] == pytest.approx(z if i == 2 else -0.2)  # a simulated Tello's floor is level
