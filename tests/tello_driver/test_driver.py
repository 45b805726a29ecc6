"""One driver and one simulated Tello, in a time of their own: what the driver has its drone do."""

from __future__ import annotations

from collections.abc import Callable
from math import cos, dist, sin
from random import Random

import pytest
from flockwire_core.domain.airframe import Command, FlightState
from flockwire_core.domain.order import Stop
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.process.cores import Datagram
from flockwire_core.process.driving import RETIREMENT
from flockwire_core.wire.keys import STOP, Key
from flockwire_tello.driver import DriverCore, slowest_climb
from flockwire_tello.flight_monitor import FlightMonitor
from flockwire_tello.state_string import format_state
from flockwire_tello.swarm_file import COMMAND_PORT, tello_addresses
from flockwire_twins.tello.parameters import TelloParameters, switched
from flockwire_twins.tello.tello import SimulatedTello

BEGAN = 1_790_000_000 * SECOND
TICK = SECOND // 100
TELLO = {"drones.1.airframe": "tello", "limits.speed": 1.0}
HEADING = 2.0


class Flight:
    """A driver and its Tello; the pilot commands `velocity`, nothing if that is None."""

    def __init__(self, swarm, *quirks: str, chance: Callable[[], float] = lambda: 0.5, **parameters: object) -> None:
        self.swarm, self.now = swarm, BEGAN
        self.velocity: tuple[float, float, float] | None = None
        self.posed = True
        self.sent: list[tuple[float, str]] = []  # s since the beginning, command
        self.telemetry = []
        self.lost: Callable[[Datagram], bool] = lambda _: False
        self.on_air: Callable[[bytes], bytes] = lambda data: data
        wanted = {"yaw": HEADING, "position": (0.0, 0.0, 0.0), **parameters}
        self.tello = SimulatedTello(TelloParameters(quirks=switched(quirks), **wanted), 0, chance)
        self.driver = DriverCore(swarm, 1, self.now)
        self.address = (tello_addresses(swarm, 1).drone, COMMAND_PORT)

    @property
    def t(self) -> float:
        return (self.now - BEGAN) / SECOND

    @property
    def motion(self):
        return self.tello.flight.airframe.motion(self.now - BEGAN)

    @property
    def state(self) -> FlightState | None:
        return self.telemetry[-1].state if self.telemetry else None

    def restart(self) -> None:
        """Kill the driver; a new one knows nothing."""
        self.driver = DriverCore(self.swarm, 1, self.now)

    def flush(self) -> None:
        for datagram in self.driver.outgoing(self.now):
            self.sent.append((self.t, datagram.data.decode()))
            if not self.lost(datagram):
                self.tello.receive(datagram.data, datagram.source, self.now - BEGAN)

    def give(self, key: Key, message: object) -> None:
        self.driver.receive(key, message, self.now)
        self.flush()

    def run(self, seconds: float) -> None:
        end = self.now + nanoseconds(seconds)
        while self.now < end:
            self.now += TICK
            for data, target in self.tello.outgoing(self.now - BEGAN):
                self.driver.datagram(self.on_air(data), self.address, target, self.now)
                self.flush()
            if self.posed:
                half = self.motion.yaw / 2.0
                self.give(
                    Key("pose", "uav1"), Pose(self.now, "w", self.motion.position, (0.0, 0.0, sin(half), cos(half)))
                )
            if self.velocity is not None:
                self.give(Key("command", "uav1"), Command(self.now, "w", self.velocity))
            if self.now // TICK % 2:
                self.telemetry += [message for _, message in self.driver.step(self.now)]
                self.flush()

    def words(self, begin: float = 0.0) -> list[str]:
        return [command.split()[0] for at, command in self.sent if at >= begin]

    def rise(self) -> None:
        """Take off and hover."""
        self.run(1.0)
        self.velocity = (0.0, 0.0, 0.7)
        self.run(5.0)
        self.velocity = (0.0, 0.0, 0.0)
        self.run(1.0)
        assert self.state is FlightState.FLYING


@pytest.fixture
def flight(make_swarm):
    return lambda *quirks, **parameters: Flight(make_swarm(TELLO), *quirks, **parameters)


@pytest.fixture
def airborne(flight):
    found = flight()
    found.rise()
    return found


def test_a_command_to_rise_takes_off_once_and_a_descent_near_the_ground_lands(flight):
    found = flight()
    found.rise()
    assert found.words().count("takeoff") == 1
    assert found.motion.position[2] > 0.9
    found.velocity = (0.0, 0.0, -0.5)
    found.run(7.0)
    assert found.words().count("land") == 1
    assert found.state is FlightState.GROUNDED
    assert found.motion.position[2] == 0.0
    assert found.driver.may_end(found.now)


@pytest.mark.parametrize(
    ("changes", "climb"),
    [
        ({}, 0.5),  # the usual limits.blind_speed
        ({"limits.vertical_speed": 0.2}, 0.2),
        ({"limits.blind_speed": 0.1}, 0.1),
        ({"control.law": "extended", "avoidance.sensing_radius": 0.6}, 0.18),
    ],
)
def test_every_limit_counts_for_how_slowly_a_pilot_may_take_off(make_swarm, changes, climb):
    assert slowest_climb(make_swarm(TELLO | changes), 1) == pytest.approx(climb, abs=0.01)


def test_a_slow_descent_near_the_ground_is_not_a_landing_where_landings_are_faster(airborne):
    airborne.velocity = (0.0, 0.0, -0.15)
    airborne.run((airborne.motion.position[2] - 0.25) / 0.15)
    assert 0.2 < airborne.motion.position[2] < 0.35
    assert "land" not in airborne.words()


def test_from_takeoff_on_it_is_reported_to_fly(flight):
    found = flight()
    found.velocity = (0.0, 0.0, 0.7)
    while "takeoff" not in found.words():
        found.run(0.1)
    found.run(0.2)
    assert found.motion.position[2] == 0.0
    assert found.state is FlightState.FLYING


def test_a_world_velocity_is_flown_in_the_world_whatever_the_heading(airborne):
    start = airborne.motion.position
    airborne.velocity = (0.3, -0.1, 0.05)
    airborne.run(4.0)
    moved = [b - a for a, b in zip(start, airborne.motion.position, strict=True)]
    expected = [v * (4.0 - 0.35) for v in airborne.velocity]  # behind lag and dead time
    assert dist(moved, expected) < 0.02


def test_a_velocity_of_a_fraction_of_a_stick_is_flown_on_the_average(airborne):
    start = airborne.motion.position
    airborne.velocity = (0.004, 0.0027, 0.0)
    airborne.run(20.0)
    moved = [b - a for a, b in zip(start, airborne.motion.position, strict=True)]
    assert moved[0] == pytest.approx(0.08, abs=0.005)
    assert moved[1] == pytest.approx(0.054, abs=0.005)


def test_the_heading_is_held_against_a_drift(airborne):
    before = airborne.motion.yaw
    drift = airborne.tello._drone.flight.airframe
    for _ in range(40):
        drift._motion = drift._motion._replace(yaw=drift._motion.yaw + 0.005)
        airborne.run(0.1)
    assert abs(airborne.motion.yaw - before) < 0.06  # 0.2 rad of drift in all


def test_what_is_too_fast_is_clipped_to_the_limit_in_its_direction(airborne):
    airborne.velocity = (3.0, 4.0, 0.0)
    airborne.run(2.0)
    assert airborne.motion.velocity[:2] == pytest.approx((0.6, 0.8), abs=0.03)
    assert dict(airborne.driver.report(airborne.now).counts)["commands clipped"] > 100


def test_rc_comes_at_the_configured_rate_though_commands_come_twice_as_often(airborne):
    begin = airborne.t
    airborne.run(4.0)
    assert airborne.words(begin).count("rc") == pytest.approx(200, abs=3)


def test_a_command_has_its_datagram_before_the_next_step(airborne):
    airborne.run(0.1)
    airborne.now += 20 * 10**6
    airborne.sent.clear()
    airborne.give(Key("command", "uav1"), Command(airborne.now, "w", (0.2, 0.0, 0.0)))
    assert airborne.words() == ["rc"]


def test_a_stale_command_centres_the_sticks_then_lands(airborne):
    airborne.velocity = (0.5, 0.0, 0.0)
    airborne.run(1.0)
    stale, airborne.velocity = airborne.t, None
    airborne.run(0.9)
    assert {c for at, c in airborne.sent if stale + 0.25 < at} == {"rc 0 0 0 0"}
    airborne.run(0.3)
    assert airborne.words(stale).count("land") == 1
    assert airborne.state is FlightState.LANDING
    airborne.run(5.0)
    assert airborne.state is FlightState.GROUNDED


def test_a_stop_sends_emergency_three_times_at_once_without_a_step(airborne):
    airborne.sent.clear()
    airborne.give(STOP, Stop(airborne.now, "w", "test"))
    assert airborne.words() == ["emergency"] * 3
    airborne.run(0.2)
    assert airborne.state is FlightState.FLYING  # nothing shows yet that the motors are off
    assert "rc" not in airborne.words()
    airborne.run(2.0)
    assert airborne.state is FlightState.STOPPED
    assert airborne.motion.position[2] == 0.0
    airborne.velocity = (0.0, 0.0, 0.7)
    airborne.run(2.0)
    assert "takeoff" not in airborne.words()


def test_that_a_stop_was_received_is_reported_at_once_and_apart_from_that_the_drone_is_down(airborne):
    assert not airborne.telemetry[-1].stop_received
    count = len(airborne.telemetry)
    airborne.give(STOP, Stop(airborne.now, "w", "test"))
    airborne.run(0.02)
    (telemetry,) = airborne.telemetry[count:]
    assert (telemetry.stop_received, telemetry.state) == (True, FlightState.FLYING)
    for _ in range(10):  # the operator repeats it: the telemetry keeps its rate
        airborne.give(STOP, Stop(airborne.now, "w", "test"))
        airborne.run(0.02)
    assert len(airborne.telemetry) - count <= 4
    airborne.run(2.5)
    assert airborne.telemetry[-1].stop_received
    assert airborne.state is FlightState.STOPPED


def test_a_stop_gets_through_a_lossy_network(airborne):
    dropped = iter([True] * 5)
    airborne.lost = lambda _: next(dropped, False)
    airborne.give(STOP, Stop(airborne.now, "w", "test"))
    airborne.run(0.1)
    assert not airborne.tello.flight.flying


def test_a_stop_in_a_gap_of_the_link_is_repeated_until_it_is_over_and_the_drone_down(airborne):
    airborne.lost = lambda _: True
    airborne.on_air = lambda _: b""
    airborne.give(STOP, Stop(airborne.now, "w", "test"))
    airborne.run(5.0)
    assert airborne.tello.flight.flying
    assert {telemetry.state for telemetry in airborne.telemetry[-20:]} == {FlightState.FLYING}
    assert "keep away from it" in airborne.driver.report(airborne.now).line
    assert not airborne.driver.may_end(airborne.now)
    airborne.lost, airborne.on_air = lambda _: False, lambda data: data
    airborne.run(0.2)
    assert not airborne.tello.flight.flying
    airborne.run(2.5)
    assert airborne.state is FlightState.STOPPED
    assert "keep away from it" not in airborne.driver.report(airborne.now).line
    end = airborne.t
    airborne.run(5.0)
    assert airborne.words(end) == []
    assert airborne.driver.may_end(airborne.now)


def test_a_stopped_drone_whose_commands_are_lost_is_reported_to_fly(airborne):
    airborne.lost = lambda _: True
    airborne.give(STOP, Stop(airborne.now, "w", "test"))
    end = airborne.t
    airborne.run(10.0)
    assert {telemetry.state for telemetry in airborne.telemetry} <= {FlightState.GROUNDED, FlightState.FLYING}
    assert airborne.words(end + 5.0).count("emergency") == pytest.approx(3 * 10 * 5, abs=3)


def test_a_stopped_drone_whose_state_goes_to_another_client_is_asked_for_it_again(airborne):
    airborne.tello.receive(b"command", ("127.0.0.77", 5000), airborne.now - BEGAN)
    dropped = iter([True])
    airborne.lost = lambda datagram: datagram.data == b"command" and next(dropped, False)
    airborne.give(STOP, Stop(airborne.now, "w", "test"))
    airborne.run(5.0)
    assert airborne.state is FlightState.STOPPED


@pytest.mark.parametrize("seed", range(8))
def test_stopped_is_reported_only_of_motors_that_are_off(airborne, seed):
    chance = Random(seed)
    airborne.lost = lambda _: chance.random() < 0.99
    airborne.on_air = lambda data: data if chance.random() < 0.5 else b""
    airborne.give(STOP, Stop(airborne.now, "w", "test"))
    while airborne.state is not FlightState.STOPPED:
        assert airborne.t < 60.0
        airborne.run(0.1)
    assert not airborne.tello.flight.flying


def test_a_drone_on_the_ground_is_stopped_at_once(flight):
    found = flight()
    found.run(1.0)
    found.give(STOP, Stop(found.now, "w", "test"))
    found.run(0.2)
    assert found.state is FlightState.STOPPED
    found.run(1.0)
    end = found.t
    found.run(2.0)
    assert found.words(end) == []


def test_a_driver_that_is_restarted_in_flight_takes_the_drone_over_without_a_jump(airborne):
    airborne.velocity = (0.3, 0.0, 0.0)
    airborne.run(2.0)
    before, began = airborne.motion, airborne.t
    airborne.restart()
    fastest = []
    for _ in range(200):
        airborne.run(0.01)
        fastest.append(dist(airborne.motion.velocity, before.velocity))
    assert "takeoff" not in airborne.words(began)
    assert "land" not in airborne.words(began)
    assert airborne.state is FlightState.FLYING
    assert max(fastest) < 0.05
    assert airborne.motion.position[0] - before.position[0] == pytest.approx(0.6, abs=0.03)


@pytest.mark.parametrize("flown", [False, True], ids=["switched on just now", "after a flight"])
def test_a_drone_in_a_hand_does_not_fly_and_does_not_take_off(flight, flown):
    found = flight()
    if flown:
        found.rise()
        found.velocity = None
        found.run(8.0)
    else:
        found.run(1.0)
    assert found.state is FlightState.GROUNDED
    found.telemetry.clear()
    found.tello.flight.airframe.hold(1.2, found.now - BEGAN)
    begin, found.velocity = found.t, (0.0, 0.0, 0.7)
    found.run(5.0)
    assert {telemetry.state for telemetry in found.telemetry[2:]} == {FlightState.HELD}
    assert "takeoff" not in found.words(begin)
    assert "held in a hand" in found.driver.report(found.now).line
    assert found.driver.may_end(found.now)
    found.tello.flight.airframe.hold(0.0, found.now - BEGAN)
    found.run(2.0)
    assert found.state is FlightState.GROUNDED
    assert "takeoff" not in found.words(begin)  # its pilot has wanted it all the time
    found.velocity = (0.0, 0.0, 0.0)
    found.rise()


def test_a_driver_that_starts_with_its_drone_in_a_hand_finds_out(flight):
    found = flight()
    found.rise()
    found.velocity = None
    found.run(8.0)
    found.tello.flight.airframe.hold(1.0, found.now - BEGAN)
    found.restart()
    found.run(4.5)
    assert found.state is FlightState.HELD
    found.give(STOP, Stop(found.now, "w", "test"))
    found.run(2.0)
    assert found.state is FlightState.STOPPED


def test_a_flight_with_many_lost_states_is_not_taken_for_a_hand(airborne):
    airborne.restart()
    chance = Random(7)
    airborne.on_air = lambda data: data if chance.random() < 0.3 else b""
    airborne.run(20.0)
    assert FlightState.HELD not in {telemetry.state for telemetry in airborne.telemetry}


def test_a_lost_takeoff_is_sent_again_when_the_state_shows_that_it_was_lost_and_not_before(flight):
    found, dropped = flight(), iter([True])
    found.lost = lambda datagram: datagram.data == b"takeoff" and next(dropped, False)
    found.run(1.0)
    found.velocity = (0.0, 0.0, 0.7)
    found.run(2.9)
    assert found.words().count("takeoff") == 1
    found.run(12.0)
    assert found.words().count("takeoff") == 2
    assert found.state is FlightState.FLYING


def test_a_lost_reply_to_takeoff_does_not_send_it_again(flight):
    found = flight()
    found.run(1.0)
    found.on_air = lambda data: b"" if data == b"ok" else data
    found.velocity = (0.0, 0.0, 0.7)
    found.run(8.0)
    assert found.words().count("takeoff") == 1
    assert found.state is FlightState.FLYING
    assert "rc" in found.words(7.5)


@pytest.mark.parametrize("quirk", ["not-activated", "low-battery"])
def test_a_refused_takeoff_is_reported_and_not_tried_again_until_the_pilot_asks_again(flight, quirk):
    found = flight(quirk)
    found.run(1.0)
    found.velocity = (0.0, 0.0, 0.7)
    found.run(10.0)
    assert found.words().count("takeoff") == 1
    assert "take-off refused (error)" in found.driver.report(found.now).line
    found.velocity = (0.0, 0.0, 0.0)
    found.run(0.5)
    found.velocity = (0.0, 0.0, 0.7)
    found.run(1.0)
    assert found.words().count("takeoff") == 2


def test_a_lost_land_is_sent_again_until_the_state_shows_it_down(airborne):
    dropped = iter([True, True])
    airborne.lost = lambda datagram: datagram.data == b"land" and next(dropped, False)
    airborne.velocity = None
    airborne.run(16.0)
    assert airborne.state is FlightState.GROUNDED


def run_without_landing(found: Flight, seconds: float, reply: bytes = b"") -> None:
    """Run while each `land` is lost; its place takes a `reply`, if any."""
    refusals = []
    found.lost = lambda datagram: datagram.data == b"land" and (refusals.append(0) or True)
    for _ in range(round(seconds / 0.04)):
        found.run(0.04)
        while reply and refusals:
            refusals.pop()
            found.driver.datagram(reply, found.address, found.driver.sockets[0], found.now)
            found.flush()


def test_a_landing_centres_the_sticks_first_and_beside_it(airborne):
    airborne.velocity = (1.0, 0.0, 0.0)
    airborne.run(1.0)
    airborne.now += nanoseconds(1.5)  # its process was frozen: the last sticks still hold
    airborne.sent.clear()
    end = airborne.t
    airborne.velocity = None
    run_without_landing(airborne, 2.0)
    assert [command for _, command in airborne.sent[:2]] == ["rc 0 0 0 0", "land"]
    assert {command for _, command in airborne.sent} == {"rc 0 0 0 0", "land"}
    assert airborne.words(end).count("rc") >= 45
    assert airborne.words(end).count("land") == pytest.approx(4, abs=1)
    assert max(map(abs, airborne.motion.velocity)) < 0.01


def test_a_landing_between_two_sticks_centres_them_first(airborne):
    airborne.velocity = (1.0, 0.0, 0.0)
    airborne.run(1.0)
    airborne.sent.clear()
    airborne.driver._flight.land(airborne.now - airborne.driver._began)
    airborne.flush()
    assert [command for _, command in airborne.sent] == ["rc 0 0 0 0", "land"]


def test_a_pilot_does_not_steer_a_drone_that_its_driver_lands(airborne):
    airborne.velocity = (1.0, 0.0, 0.0)
    airborne.run(1.0)
    airborne.driver._flight.land(airborne.now - airborne.driver._began)
    begin = airborne.t
    run_without_landing(airborne, 1.0)
    assert {command for at, command in airborne.sent if at > begin} == {"rc 0 0 0 0", "land"}


def test_a_refused_landing_is_repeated_at_once_with_the_sticks_centred(airborne):
    airborne.velocity = None
    airborne.run(0.9)
    begin = airborne.t
    run_without_landing(airborne, 2.0, b"error")
    assert airborne.words(begin).count("land") > 20
    assert airborne.words(begin).count("rc") >= 45
    airborne.lost = lambda _: False
    airborne.run(5.0)
    assert airborne.state is FlightState.GROUNDED


def test_a_landing_that_is_seen_is_not_repeated(airborne):
    airborne.driver._flight.land(airborne.now - airborne.driver._began)
    airborne.run(5.0)
    assert airborne.state is FlightState.GROUNDED
    assert airborne.words().count("land") <= 2


def test_a_landing_that_ends_above_the_ground_is_repeated(airborne):
    airborne.velocity = None
    while airborne.motion.position[2] > 0.8:
        airborne.run(0.1)
    airborne.tello.receive(b"stop", airborne.driver.sockets[0], airborne.now - BEGAN)
    airborne.run(0.4)
    begin = airborne.t
    airborne.run(0.6)
    assert "land" in airborne.words(begin)
    airborne.run(5.0)
    assert airborne.state is FlightState.GROUNDED


def test_lost_datagrams_and_late_replies_do_not_keep_it_from_flying(flight):
    quirks = "lost-datagrams", "late-replies", "junk-before-first-reply"
    found = flight(*quirks, chance=Random(4).random, loss=0.1)
    found.rise()
    found.velocity = (0.0, 0.0, -0.5)
    found.run(12.0)
    assert found.state is FlightState.GROUNDED


def test_a_driver_that_is_to_end_lands_what_the_pilot_does_not(airborne):
    airborne.driver.retire(airborne.now)
    assert not airborne.driver.may_end(airborne.now)
    airborne.run(RETIREMENT / SECOND - 0.1)
    assert airborne.state is FlightState.FLYING
    airborne.run(6.0)
    assert airborne.state is FlightState.GROUNDED
    assert airborne.driver.may_end(airborne.now)


def test_without_a_pose_only_up_and_down_are_flown(airborne):
    airborne.restart()
    airborne.posed = False
    airborne.velocity = (0.5, 0.5, 0.1)
    before = airborne.motion.position
    airborne.run(0.5)
    assert {c.split()[1] + c.split()[2] for _, c in airborne.sent[-5:]} == {"00"}
    assert airborne.motion.position[2] > before[2]


def test_with_an_old_heading_only_up_and_down_are_flown_and_reported(airborne):
    def across() -> set[str]:
        return {" ".join(command.split()[1:3]) for _, command in airborne.sent[-5:]}

    airborne.velocity = (0.3, 0.3, 0.05)
    airborne.posed = False
    airborne.run(airborne.swarm.limits.staleness.pose_land - 0.1)
    assert "0 0" not in across()
    before = airborne.motion.position
    airborne.run(1.5)
    assert across() == {"0 0"}
    assert "no pose arrives" in airborne.driver.report(airborne.now).line
    assert airborne.motion.position[2] > before[2]
    airborne.posed = True
    airborne.run(0.2)
    assert "0 0" not in across()
    assert airborne.driver.report(airborne.now).line == ""


def test_a_loop_over_a_heading_that_drifts_unseen_does_not_run_away(airborne):
    start, airframe = airborne.motion.position, airborne.tello._drone.flight.airframe
    airborne.posed = False
    for _ in range(100):  # the pilot's own pose is fresh: it draws its drone back to its place
        airframe._motion = airframe._motion._replace(yaw=airframe._motion.yaw + 0.03)
        x, y, _ = airborne.motion.position
        airborne.velocity = (1.5 * (start[0] + 0.05 - x), 1.5 * (start[1] - y), 0.0)
        airborne.run(0.1)
    assert dist(airborne.motion.position, start) < 0.2


def test_datagrams_of_others_are_left_out_unless_the_filter_is_off(make_swarm):
    for filtered in (True, False):
        swarm = make_swarm(TELLO | {"drones.1.tello": {"source_filter": filtered}})
        driver = DriverCore(swarm, 1, BEGAN)
        state = format_state(SimulatedTello(TelloParameters(generation="1.3"), 0).state(0))
        driver.datagram(state, ("10.9.9.9", 8889), driver.sockets[1], BEGAN)
        driver.step(BEGAN + TICK)
        assert (driver.report(BEGAN + TICK).phase == "grounded") is not filtered


def test_a_drone_that_was_switched_off_and_on_is_entered_again(flight):
    found = flight()
    found.run(1.0)
    found.tello = SimulatedTello(found.tello.parameters, found.now - BEGAN)
    found.run(3.0)
    assert found.words().count("command") == 2
    found.velocity = (0.0, 0.0, 0.7)
    found.run(6.0)
    assert found.state is FlightState.FLYING


def test_telemetry_carries_the_age_of_the_state_and_stops_with_it(airborne):
    count = len(airborne.telemetry)
    airborne.run(1.0)
    assert len(airborne.telemetry) - count == pytest.approx(10, abs=1)
    airborne.on_air = lambda _: b""
    airborne.run(1.5)
    count = len(airborne.telemetry)
    assert airborne.telemetry[-1].stamp <= airborne.now - 0.5 * SECOND
    assert {message.stamp for message in airborne.telemetry[-5:]} == {airborne.telemetry[-1].stamp}  # of one state
    airborne.run(1.0)
    assert len(airborne.telemetry) == count


TROUBLES = {
    "nobody": (lambda found: setattr(found, "lost", lambda _: True), "no reply from 127"),
    "no state": (
        lambda f: setattr(f, "on_air", lambda data: b"" if b"bat:" in data else data),
        "state does not come to",
    ),
    "unknown form": (
        lambda f: setattr(f, "on_air", lambda data: b"height=3;" if b"bat:" in data else data),
        "form that no SDK has",
    ),
    "refused": (
        lambda f: setattr(f, "on_air", lambda data: b"" if b"bat:" in data else b"error"),
        "refuses SDK mode (error)",
    ),
}


@pytest.mark.parametrize("kind", TROUBLES)
def test_what_is_wrong_with_the_link_is_one_line_with_a_remedy(flight, kind):
    spoil, text = TROUBLES[kind]
    found = flight()
    spoil(found)
    found.run(9.0)
    detail = found.driver.report(found.now).line
    assert text in detail
    assert "\n" not in detail
    assert ":" in detail
    assert found.telemetry == []


def test_another_client_that_takes_the_state_is_named(flight):
    found = flight()
    for _ in range(4):
        found.run(1.5)
        found.tello.receive(b"command", ("127.0.0.77", 5000), found.now - BEGAN)  # the state goes there from now on
        sink, found.on_air = found.on_air, lambda data: b"" if b"bat:" in data else data
        found.run(1.2)
        found.on_air = sink
    found.run(1.0)
    assert "another client" in found.driver.report(found.now).line


def test_the_report_names_the_drone(flight):
    found = flight()
    found.run(1.0)
    assert found.driver.report(found.now).line == f"SDK 20; {found.tello.parameters.serial}"


@pytest.mark.parametrize(
    ("changed", "text"),
    [
        ({"roll": 25}, "IMU shows a tilt of 25 degrees: place it level"),
        ({"agx": 0.0, "agy": 0.0, "agz": 0.0}, "IMU has no data: switch it off and on"),
        ({}, ""),
    ],
)
def test_an_imu_that_is_off_on_the_ground_is_named(changed, text):
    monitor = FlightMonitor()
    monitor.update(SimulatedTello(TelloParameters(), 0).state(0)._replace(**changed), 5)
    trouble = monitor.imu_trouble(6)
    assert (trouble.line if trouble else "").startswith(text)
    assert bool(trouble) is bool(text)
