"""One driver and one simulated Tello, in a time of their own: what the driver has its drone do."""

from __future__ import annotations

from collections.abc import Callable
from math import cos, dist, sin
from random import Random

import pytest
from flockwire.flight.cores import Datagram
from flockwire.nanoseconds import BILLION
from flockwire.wire.keys import STOP, Key
from flockwire.wire.messages import Command, FlightState, Pose, Stop
from flockwire_tello.driver import DriverCore, slowest_climb
from flockwire_tello.flight_monitor import FlightMonitor
from flockwire_tello.quirks import switched
from flockwire_tello.simulated_tello import SimulatedTello
from flockwire_tello.state_string import format_state
from flockwire_tello.tello_parameters import TelloParameters
from flockwire_tello.timing import RETIREMENT

BEGAN = 1_790_000_000 * BILLION
TICK = BILLION // 100
TELLO = {"drones.1.airframe": "tello", "limits.speed": 1.0}
HEADING = 2.0


class Flight:
    """A driver and its Tello; the pilot commands `velocity`, nothing where that is None."""

    def __init__(self, swarm, *quirks: str, **parameters: object) -> None:
        self.swarm, self.now = swarm, BEGAN
        self.velocity: tuple[float, float, float] | None = None
        self.posed = True
        self.sent: list[tuple[float, str]] = []  # s since the beginning, command
        self.telemetry = []
        self.lost: Callable[[Datagram], bool] = lambda _: False
        self.on_air: Callable[[bytes], bytes] = lambda data: data
        wanted = {"yaw": HEADING, "position": (0.0, 0.0, 0.0), **parameters}
        self.tello = SimulatedTello(TelloParameters(quirks=switched(quirks), **wanted), 0)
        self.driver = DriverCore(swarm, 1, self.now)

    @property
    def t(self) -> float:
        return (self.now - BEGAN) / BILLION

    @property
    def motion(self):
        return self.tello.motion(self.now - BEGAN)

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
        end = self.now + round(seconds * BILLION)
        while self.now < end:
            self.now += TICK
            for data, target in self.tello.outgoing(self.now - BEGAN):
                self.driver.datagram(self.on_air(data), self.driver._drone, target, self.now)
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
def aloft(flight):
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


def test_a_slow_descent_near_the_ground_is_no_landing_where_landings_are_faster(aloft):
    aloft.velocity = (0.0, 0.0, -0.15)
    aloft.run((aloft.motion.position[2] - 0.25) / 0.15)
    assert 0.2 < aloft.motion.position[2] < 0.35
    assert "land" not in aloft.words()


def test_from_takeoff_on_it_is_reported_to_fly(flight):
    found = flight()
    found.velocity = (0.0, 0.0, 0.7)
    while "takeoff" not in found.words():
        found.run(0.1)
    found.run(0.2)
    assert found.motion.position[2] == 0.0
    assert found.state is FlightState.FLYING


def test_a_world_velocity_is_flown_in_the_world_whatever_the_heading(aloft):
    start = aloft.motion.position
    aloft.velocity = (0.3, -0.1, 0.05)
    aloft.run(4.0)
    moved = [b - a for a, b in zip(start, aloft.motion.position, strict=True)]
    expected = [v * (4.0 - 0.35) for v in aloft.velocity]  # behind lag and dead time
    assert dist(moved, expected) < 0.02


def test_a_velocity_of_a_fraction_of_a_stick_is_flown_on_the_average(aloft):
    start = aloft.motion.position
    aloft.velocity = (0.004, 0.0027, 0.0)
    aloft.run(20.0)
    moved = [b - a for a, b in zip(start, aloft.motion.position, strict=True)]
    assert moved[0] == pytest.approx(0.08, abs=0.005)
    assert moved[1] == pytest.approx(0.054, abs=0.005)


def test_the_heading_is_held_against_a_drift(aloft):
    before = aloft.motion.yaw
    drift = aloft.tello._drone.flight.airframe
    for _ in range(40):
        drift._motion = drift._motion._replace(yaw=drift._motion.yaw + 0.005)
        aloft.run(0.1)
    assert abs(aloft.motion.yaw - before) < 0.06  # 0.2 rad of drift in all


def test_what_is_too_fast_is_clipped_to_the_limit_in_its_direction(aloft):
    aloft.velocity = (3.0, 4.0, 0.0)
    aloft.run(2.0)
    assert aloft.motion.velocity[:2] == pytest.approx((0.6, 0.8), abs=0.03)
    assert dict(aloft.driver.report(aloft.now).counts)["commands clipped"] > 100


def test_rc_comes_at_the_configured_rate_though_commands_come_twice_as_often(aloft):
    begin = aloft.t
    aloft.run(4.0)
    assert aloft.words(begin).count("rc") == pytest.approx(200, abs=3)


def test_a_command_has_its_datagram_before_the_next_step(aloft):
    aloft.run(0.1)
    aloft.now += 20 * 10**6
    aloft.sent.clear()
    aloft.give(Key("command", "uav1"), Command(aloft.now, "w", (0.2, 0.0, 0.0)))
    assert aloft.words() == ["rc"]


def test_a_stale_command_centres_the_sticks_then_lands(aloft):
    aloft.velocity = (0.5, 0.0, 0.0)
    aloft.run(1.0)
    stale, aloft.velocity = aloft.t, None
    aloft.run(0.9)
    assert {c for at, c in aloft.sent if stale + 0.25 < at} == {"rc 0 0 0 0"}
    aloft.run(0.3)
    assert aloft.words(stale).count("land") == 1
    assert aloft.state is FlightState.LANDING
    aloft.run(5.0)
    assert aloft.state is FlightState.GROUNDED


def test_a_stop_sends_emergency_three_times_at_once_without_a_step(aloft):
    aloft.sent.clear()
    aloft.give(STOP, Stop(aloft.now, "w", "test"))
    assert aloft.words() == ["emergency"] * 3
    aloft.run(0.2)
    assert aloft.state is FlightState.FLYING  # nothing shows yet that the motors are off
    assert "rc" not in aloft.words()
    aloft.run(2.0)
    assert aloft.state is FlightState.STOPPED
    assert aloft.motion.position[2] == 0.0
    aloft.velocity = (0.0, 0.0, 0.7)
    aloft.run(2.0)
    assert "takeoff" not in aloft.words()


def test_a_stop_gets_through_a_lossy_network(aloft):
    dropped = iter([True] * 5)
    aloft.lost = lambda _: next(dropped, False)
    aloft.give(STOP, Stop(aloft.now, "w", "test"))
    aloft.run(0.1)
    assert not aloft.tello._drone.flight.airframe.motors


def test_a_stop_in_a_gap_of_the_link_is_repeated_until_it_is_over_and_the_drone_down(aloft):
    aloft.lost = lambda _: True
    aloft.on_air = lambda _: b""
    aloft.give(STOP, Stop(aloft.now, "w", "test"))
    aloft.run(5.0)
    assert aloft.tello._drone.flight.airframe.motors
    assert {telemetry.state for telemetry in aloft.telemetry[-20:]} == {FlightState.FLYING}
    assert "keep clear of it" in aloft.driver.report(aloft.now).detail
    assert not aloft.driver.may_end(aloft.now)
    aloft.lost, aloft.on_air = lambda _: False, lambda data: data
    aloft.run(0.2)
    assert not aloft.tello._drone.flight.airframe.motors
    aloft.run(2.5)
    assert aloft.state is FlightState.STOPPED
    assert "keep clear of it" not in aloft.driver.report(aloft.now).detail
    end = aloft.t
    aloft.run(5.0)
    assert aloft.words(end) == []
    assert aloft.driver.may_end(aloft.now)


def test_a_stopped_drone_whose_commands_are_lost_is_reported_to_fly(aloft):
    aloft.lost = lambda _: True
    aloft.give(STOP, Stop(aloft.now, "w", "test"))
    end = aloft.t
    aloft.run(10.0)
    assert {telemetry.state for telemetry in aloft.telemetry} <= {FlightState.GROUNDED, FlightState.FLYING}
    assert aloft.words(end + 5.0).count("emergency") == pytest.approx(3 * 10 * 5, abs=3)


def test_a_stopped_drone_whose_state_goes_to_another_client_is_asked_for_it_again(aloft):
    aloft.tello.receive(b"command", ("127.0.0.77", 5000), aloft.now - BEGAN)
    dropped = iter([True])
    aloft.lost = lambda datagram: datagram.data == b"command" and next(dropped, False)
    aloft.give(STOP, Stop(aloft.now, "w", "test"))
    aloft.run(5.0)
    assert aloft.state is FlightState.STOPPED


@pytest.mark.parametrize("seed", range(8))
def test_stopped_is_reported_only_of_motors_that_are_off(aloft, seed):
    chance = Random(seed)
    aloft.lost = lambda _: chance.random() < 0.99
    aloft.on_air = lambda data: data if chance.random() < 0.5 else b""
    aloft.give(STOP, Stop(aloft.now, "w", "test"))
    while aloft.state is not FlightState.STOPPED:
        assert aloft.t < 60.0
        aloft.run(0.1)
    assert not aloft.tello._drone.flight.airframe.motors


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


def test_a_driver_that_is_restarted_in_flight_takes_the_drone_over_without_a_jump(aloft):
    aloft.velocity = (0.3, 0.0, 0.0)
    aloft.run(2.0)
    before, began = aloft.motion, aloft.t
    aloft.restart()
    fastest = []
    for _ in range(200):
        aloft.run(0.01)
        fastest.append(dist(aloft.motion.velocity, before.velocity))
    assert "takeoff" not in aloft.words(began)
    assert "land" not in aloft.words(began)
    assert aloft.state is FlightState.FLYING
    assert max(fastest) < 0.05
    assert aloft.motion.position[0] - before.position[0] == pytest.approx(0.6, abs=0.03)


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
    assert "take-off refused (error)" in found.driver.report(found.now).detail
    found.velocity = (0.0, 0.0, 0.0)
    found.run(0.5)
    found.velocity = (0.0, 0.0, 0.7)
    found.run(1.0)
    assert found.words().count("takeoff") == 2


def test_a_lost_land_is_sent_again_until_the_state_shows_it_down(aloft):
    dropped = iter([True, True])
    aloft.lost = lambda datagram: datagram.data == b"land" and next(dropped, False)
    aloft.velocity = None
    aloft.run(16.0)
    assert aloft.state is FlightState.GROUNDED


def test_lost_datagrams_and_late_replies_do_not_keep_it_from_flying(flight):
    found = flight("lost-datagrams", "late-replies", "junk-before-first-reply", loss=0.1)
    found.tello._chance = Random(4).random
    found.rise()
    found.velocity = (0.0, 0.0, -0.5)
    found.run(12.0)
    assert found.state is FlightState.GROUNDED


def test_a_driver_that_is_to_end_lands_what_the_pilot_does_not(aloft):
    aloft.driver.retire(aloft.now)
    assert not aloft.driver.may_end(aloft.now)
    aloft.run(RETIREMENT / BILLION - 0.1)
    assert aloft.state is FlightState.FLYING
    aloft.run(6.0)
    assert aloft.state is FlightState.GROUNDED
    assert aloft.driver.may_end(aloft.now)


def test_without_a_pose_only_up_and_down_are_flown(aloft):
    aloft.restart()
    aloft.posed = False
    aloft.velocity = (0.5, 0.5, 0.1)
    before = aloft.motion.position
    aloft.run(0.5)
    assert {c.split()[1] + c.split()[2] for _, c in aloft.sent[-5:]} == {"00"}
    assert aloft.motion.position[2] > before[2]


def test_by_a_heading_that_is_too_old_only_up_and_down_are_flown_and_the_report_says_so(aloft):
    def across() -> set[str]:
        return {" ".join(command.split()[1:3]) for _, command in aloft.sent[-5:]}

    aloft.velocity = (0.3, 0.3, 0.05)
    aloft.posed = False
    aloft.run(aloft.swarm.limits.staleness.pose_land - 0.1)
    assert "0 0" not in across()
    before = aloft.motion.position
    aloft.run(1.5)
    assert across() == {"0 0"}
    assert "no pose comes" in aloft.driver.report(aloft.now).detail
    assert aloft.motion.position[2] > before[2]
    aloft.posed = True
    aloft.run(0.2)
    assert "0 0" not in across()
    assert aloft.driver.report(aloft.now).detail == ""


def test_a_loop_over_a_heading_that_drifts_unseen_does_not_run_away(aloft):
    start, airframe = aloft.motion.position, aloft.tello._drone.flight.airframe
    aloft.posed = False
    for _ in range(100):  # the pilot's own pose is fresh: it draws its drone back to its place
        airframe._motion = airframe._motion._replace(yaw=airframe._motion.yaw + 0.03)
        x, y, _ = aloft.motion.position
        aloft.velocity = (1.5 * (start[0] + 0.05 - x), 1.5 * (start[1] - y), 0.0)
        aloft.run(0.1)
    assert dist(aloft.motion.position, start) < 0.2


def test_datagrams_of_others_are_left_out_unless_the_filter_is_off(make_swarm):
    for filtered in (True, False):
        swarm = make_swarm(TELLO | {"drones.1.tello": {"source_filter": filtered}})
        driver = DriverCore(swarm, 1, BEGAN)
        state = format_state(SimulatedTello(TelloParameters(generation="1.3"), 0).state(0))
        driver.datagram(state, ("10.9.9.9", 8889), driver._states, BEGAN)
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


def test_telemetry_carries_the_age_of_the_state_and_stops_with_it(aloft):
    count = len(aloft.telemetry)
    aloft.run(1.0)
    assert len(aloft.telemetry) - count == pytest.approx(10, abs=1)
    aloft.on_air = lambda _: b""
    aloft.run(1.5)
    count = len(aloft.telemetry)
    assert aloft.telemetry[-1].stamp <= aloft.now - 0.5 * BILLION
    aloft.run(1.0)
    assert len(aloft.telemetry) == count


TROUBLES = {
    "nobody": (lambda found: setattr(found, "lost", lambda _: True), "no reply from 127"),
    "no state": (
        lambda f: setattr(f, "on_air", lambda data: b"" if b"bat:" in data else data),
        "state does not come to",
    ),
    "unknown form": (
        lambda f: setattr(f, "on_air", lambda data: b"height=3;" if b"bat:" in data else data),
        "form of no known SDK",
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
    detail = found.driver.report(found.now).detail
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
    assert "another client" in found.driver.report(found.now).detail


def test_the_report_names_the_drone(flight):
    found = flight()
    found.run(1.0)
    assert found.driver.report(found.now).detail == f"SDK 20, {found.tello.parameters.serial}"


@pytest.mark.parametrize(
    ("changed", "text"),
    [
        ({"roll": 25}, "IMU shows a tilt of 25 degrees: put it level"),
        ({"agx": 0.0, "agy": 0.0, "agz": 0.0}, "IMU gives nothing: switch it off and on"),
        ({}, ""),
    ],
)
def test_an_imu_that_is_off_on_the_ground_is_named(changed, text):
    monitor = FlightMonitor()
    monitor.update(SimulatedTello(TelloParameters(), 0).state(0)._replace(**changed), 5)
    assert monitor.imu_trouble(6).startswith(text)
    assert bool(monitor.imu_trouble(6)) is bool(text)
