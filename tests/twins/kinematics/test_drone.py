"""The driver's own rungs: it clips, hovers, lands for good when told to, and does not leap over a pause."""

from math import hypot

import pytest
from flockwire_core.domain.airframe import Command, FlightState
from flockwire_core.domain.order import Stop
from flockwire_core.domain.time import SECOND
from flockwire_core.process.driving import FROZEN, RETIREMENT, SETTLED, TOLERANCE
from flockwire_core.swarm.drones import Airframe
from flockwire_core.swarm.tables import Limits
from flockwire_core.wire.keys import STOP, Key
from flockwire_twins.kinematics.airframe import FirstOrderAirframe
from flockwire_twins.kinematics.core import KinematicsCore
from flockwire_twins.kinematics.drone import SimulatedDrone

BEGAN = 1_790_000_000 * SECOND
TICK = SECOND // 100
SPEED = 2.0  # m/s
HIGH = (0.0, 0.0, 1.0)


class Flight:
    """One drone in the air at HIGH, whose agent commands `velocity` unless that is None."""

    def __init__(self, velocity=None, place=HIGH, **airframe):
        frame = FirstOrderAirframe(Airframe(**airframe), place, BEGAN)
        self.now, self.drone, self.velocity = BEGAN, SimulatedDrone(frame, Limits(speed=SPEED)), velocity

    def run(self, seconds):
        for _ in range(round(seconds * 100)):
            if self.velocity is not None:
                self.drone.command(self.velocity, self.now)
            self.now += TICK
            self.drone.advance(self.now)

    @property
    def position(self):
        return self.drone.airframe.position

    @property
    def state(self):
        return self.drone.airframe.state


@pytest.mark.parametrize("velocity", [(SPEED, 0.0, 0.0), (0.0, 1.2, 1.6), (TOLERANCE * SPEED, 0.0, 0.0)])
def test_a_command_within_the_limit_is_flown_as_it_is(velocity):
    flight = Flight(velocity)
    flight.run(0.5)
    assert flight.position == pytest.approx([p + 0.5 * v for p, v in zip(HIGH, velocity, strict=True)])
    assert flight.drone.clipped == 0


@pytest.mark.parametrize("size", [1.06 * SPEED, 1e3, 1e150, 1e250])
def test_a_command_too_fast_is_flown_in_its_direction_at_the_limit_and_counted(size):
    flight = Flight((0.6 * size, 0.8 * size, 0.0))
    flight.run(0.5)
    x, y, z = flight.position
    assert (x, y, z) == pytest.approx((0.6 * SPEED * 0.5, 0.8 * SPEED * 0.5, 1.0))
    assert flight.drone.clipped == 50


def test_whatever_an_agent_commands_the_drone_flies_no_further_than_its_speed(make_swarm):
    core, now = KinematicsCore(make_swarm({"limits.speed": SPEED}), BEGAN), BEGAN
    core.receive(Key("command", "uav1"), Command(now, "world", (0.0, 0.0, 1.0)), now)
    for k in range(200):
        now += TICK
        velocity = ((-1.0) ** k * 1e300, 1e253, 1e-300)
        core.receive(Key("command", "uav1"), Command(now, "world", velocity), now)
        place = dict(core.step(now))[Key("truth", "uav1")].position
    assert hypot(place[0] + 0.7, place[1] - 2.6) <= 2.0 * SPEED + 0.1
    assert core.report(now).detail == "1 of 5 in flight, 200 commands clipped"


def test_over_a_pause_of_its_process_it_stands_still():
    flight = Flight((1.0, 0.0, 0.0))
    flight.run(1.0)
    before = flight.position
    flight.now += 10 * SECOND
    flight.drone.advance(flight.now)
    assert flight.position == before
    assert flight.state is FlightState.FLYING  # in the pause nobody could be heard
    flight.run(0.5)
    assert flight.position == pytest.approx((before[0] + 0.5, 0.0, 1.0), abs=0.02)


def test_over_a_pause_it_neither_flies_on_what_it_was_commanded_before_nor_falls():
    flight = Flight((1.0, 0.0, 0.0), dead_time=0.2)
    flight.run(1.0)
    before, flight.velocity = flight.position, None
    flight.now += 3 * SECOND
    flight.drone.advance(flight.now)
    for _ in range(10):
        flight.now += TICK
        flight.drone.advance(flight.now)
        assert flight.position[0] == pytest.approx(before[0], abs=1e-9)
    stopped = Flight((0.0, 0.0, 0.0))
    stopped.run(0.1)
    stopped.drone.airframe.stop()
    stopped.now += 3 * SECOND
    stopped.drone.advance(stopped.now)
    assert stopped.position == HIGH


def test_a_late_step_is_not_a_pause():
    flight = Flight((1.0, 0.0, 0.0))
    flight.run(1.0)
    before = flight.position[0]
    flight.now += FROZEN
    flight.drone.advance(flight.now)
    assert flight.position[0] == pytest.approx(before + 0.25)


def test_asked_to_end_it_lands_at_its_time_whatever_its_agent_commands():
    flight = Flight((0.5, 0.0, 0.0))
    flight.run(0.5)
    flight.drone.land_at = flight.now + SECOND // 2
    flight.run(0.49)
    assert (flight.state, flight.position) == (FlightState.FLYING, pytest.approx((0.495, 0.0, 1.0)))
    flight.run(3.0)
    assert flight.state is FlightState.GROUNDED
    assert flight.position == pytest.approx((0.5, 0.0, 0.0), abs=0.02)
    flight.velocity = (0.0, 0.0, 1.0)
    flight.run(1.0)
    assert flight.position[2] == 0.0  # it does not take off again


def test_it_is_in_the_air_while_it_falls():
    flight = Flight()
    flight.drone.airframe.stop()
    assert flight.drone.in_the_air
    flight.run(1.0)
    assert (flight.position[2], flight.drone.in_the_air) == (0.0, False)


class Station:
    """The kinematics of the small swarm, drone 1 of which flies; the others stand."""

    def __init__(self, swarm):
        self.now, self.core, self.velocity = BEGAN, KinematicsCore(swarm, BEGAN), (0.0, 0.0, 0.5)
        self.run(2.0)
        self.velocity = (0.0, 0.0, 0.0)

    def run(self, seconds):
        for _ in range(round(seconds * 100)):
            if self.velocity is not None:
                command = Command(self.now, "world", self.velocity)
                self.core.receive(Key("command", "uav1"), command, self.now)
            self.now += TICK
            self.truth = {key.owner: m for key, m in self.core.step(self.now) if key.kind == "truth"}

    @property
    def height(self):
        return self.truth["uav1"].position[2]


def test_asked_to_end_the_kinematics_lands_what_its_pilots_do_not_and_ends_a_second_later(make_swarm):
    station = Station(make_swarm())
    assert not station.core.may_end(station.now)
    station.core.retire(station.now)
    station.run(RETIREMENT / SECOND)
    assert station.height == pytest.approx(1.0, abs=0.02)  # the pilot's time
    assert not station.core.may_end(station.now)
    while station.height > 0.0:
        station.run(0.01)
    assert not station.core.may_end(station.now)
    station.run(SETTLED / SECOND - 0.02)
    assert not station.core.may_end(station.now)
    station.run(0.03)
    assert station.core.may_end(station.now)


def test_a_drone_whose_pilot_is_gone_is_landed_much_sooner(make_swarm):
    station = Station(make_swarm())
    station.core.retire(station.now)
    station.velocity = None
    station.run(4.0)
    assert station.height == 0.0
    assert station.core.may_end(station.now)


def test_what_falls_keeps_the_kinematics_from_ending(make_swarm):
    station = Station(make_swarm())
    station.core.receive(STOP, Stop(station.now, "world", "test"), station.now)
    station.run(0.3)
    assert station.height > 0.3
    assert not station.core.may_end(station.now)
    station.run(1.5)
    assert station.core.may_end(station.now)


def test_without_a_flight_the_kinematics_may_end_at_once(make_swarm):
    core = KinematicsCore(make_swarm(), BEGAN)
    core.step(BEGAN + 2 * SECOND)
    assert core.may_end(BEGAN + 2 * SECOND)
