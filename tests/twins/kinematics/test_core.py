import pytest
from flockwire_core.domain.airframe import Command, FlightState, Telemetry
from flockwire_core.domain.order import Stop
from flockwire_core.domain.pose import LEVEL
from flockwire_core.domain.time import SECOND
from flockwire_core.swarm.model import uav
from flockwire_core.wire.keys import STOP, Key
from flockwire_twins.kinematics import core as kinematics
from flockwire_twins.kinematics.core import KinematicsCore

BEGAN = 1_790_000_000 * SECOND
TICK = SECOND // 100


class World:
    """The kinematics of a swarm, and drone 1 in it, which obeys `velocity` unless that is None."""

    def __init__(self, swarm):
        self.now, self.core = BEGAN, KinematicsCore(swarm, BEGAN)
        self.velocity, self.published = None, {}

    def run(self, seconds):
        for _ in range(round(seconds * 100)):
            if self.velocity is not None:
                command = Command(self.now, "world", self.velocity)
                self.core.receive(Key("command", "uav1"), command, self.now)
            self.now += TICK
            self.published |= dict(self.core.step(self.now))

    @property
    def position(self):
        return self.published[Key("truth", "uav1")].position

    @property
    def telemetry(self):
        return self.published[Key("telemetry", "uav1")]


@pytest.fixture
def world(make_swarm):
    """Return the builder of a world."""
    return lambda changes=None: World(make_swarm(changes))


@pytest.fixture
def flying(world):
    """Return a world whose drone 1 is on its way at 1 m/s along X, 1.4 m high."""
    found = world()
    found.velocity = (0.0, 0.0, 0.7)
    found.run(2.0)
    found.velocity = (1.0, 0.0, 0.0)
    found.run(0.5)
    return found


def test_truth_comes_with_every_step_and_telemetry_ten_times_a_second(world):
    core, kinds = world().core, []
    for k in range(100):
        kinds += [key.kind for key, _ in core.step(BEGAN + k * TICK)]
    assert kinds.count("truth") == 5 * 100
    assert kinds.count("telemetry") == 5 * 10


def test_the_truth_of_the_last_drone_comes_last(world):
    truths = [key.owner for key, _ in world().core.step(BEGAN) if key.kind == "truth"]
    assert truths == [uav(i) for i in range(5)]


def test_drones_stand_at_their_starts_until_they_receive_a_climb_command(world):
    here = world()
    here.velocity = (1.0, 0.0, 0.0)
    here.run(0.5)
    assert here.position == (-0.7, 2.6, 0.0)
    assert here.telemetry.state is FlightState.GROUNDED


def test_a_drone_obeys_its_own_commands(flying):
    assert flying.position == pytest.approx((-0.2, 2.6, 1.4), abs=0.02)
    assert flying.telemetry.state is FlightState.FLYING
    assert flying.telemetry.height == pytest.approx(1.4, abs=0.02)
    assert flying.published[Key("truth", "uav2")].position == (2.9, -0.8, 0.0)


def test_telemetry_reports_how_old_the_last_command_is(world):
    here = world()
    here.run(0.2)
    assert here.telemetry.command_age == -1.0
    here.velocity = (0.0, 0.0, 0.5)
    here.run(0.2)
    assert 0.0 < here.telemetry.command_age <= 0.02
    here.velocity = None
    here.run(0.3)
    assert here.telemetry.command_age > 0.2


def test_without_commands_it_hovers_then_lands(flying):
    flying.velocity = None
    flying.run(0.18)
    moving = flying.position
    flying.run(0.1)
    hovering = flying.position
    assert hovering[0] > moving[0]
    flying.run(0.65)
    assert flying.position == hovering
    assert flying.telemetry.state is FlightState.FLYING
    flying.run(0.3)
    assert flying.telemetry.state is FlightState.LANDING
    assert flying.position[2] < hovering[2]
    flying.run(2.5)
    assert flying.telemetry.state is FlightState.GROUNDED
    assert flying.position == pytest.approx((hovering[0], hovering[1], 0.0))


def test_a_process_that_was_frozen_may_not_end_while_a_drone_flies(flying):
    flying.now += 5 * SECOND
    flying.core.retire(flying.now)
    assert not flying.core.may_end(flying.now)
    flying.velocity = None
    flying.run(5.0)
    assert flying.telemetry.state is FlightState.GROUNDED
    assert flying.core.may_end(flying.now)


def test_it_continues_when_commands_come_again_in_time(flying):
    flying.velocity = None
    flying.run(0.95)
    height = flying.position[2]
    flying.velocity = (0.0, 0.0, 0.5)
    flying.run(0.5)
    assert flying.telemetry.state is FlightState.FLYING
    assert flying.position[2] == pytest.approx(height + 0.25, abs=0.02)


def test_a_stop_ends_all_motors_for_good(flying):
    flying.core.receive(STOP, Stop(flying.now, "world", "test"), flying.now)
    flying.velocity = (0.0, 0.0, 0.7)
    flying.run(1.5)
    assert flying.position[2] == 0.0
    states = {flying.published[Key("telemetry", uav(i))].state for i in range(5)}
    assert states == {FlightState.STOPPED}


def test_the_battery_drains_in_flight(world):
    here = world({"airframes": {"kinematics": {"endurance": 10.0}}})
    here.velocity = (0.0, 0.0, 0.1)
    here.run(5.0)
    assert here.telemetry.battery == pytest.approx(0.5, abs=0.02)


def test_it_reports_how_many_fly(flying):
    assert flying.core.report(flying.now).detail == "1 of 5 in flight"


class Balloon:
    """An own airframe, which no one compiles: it has no driver, is its own body, and only rises."""

    orientation, failure, remark, clipped, land_at, in_the_air = LEVEL, "", "", 0, None, False

    def __init__(self, swarm, number, now, chance):
        self.airframe, self.position = self, swarm.drone(number).start

    def blow(self, wind):
        pass

    def command(self, velocity, now, yaw_rate, acceleration):
        self.position = (0.0, 0.0, self.position[2] + velocity[2] / 100)

    def advance(self, now):
        pass

    def telemetry(self, now, frame):
        return Telemetry(now, frame, FlightState.FLYING, 1.0, self.position[2], 0.0)


def test_an_own_airframe_without_a_driver_obeys_commands(world, monkeypatch):
    monkeypatch.setattr(kinematics, "load_object", lambda _: Balloon)
    found = world()
    found.velocity = (0.0, 0.0, 1.0)
    found.run(1.0)
    assert found.position == pytest.approx((0.0, 0.0, 1.0))
    assert found.telemetry.height > 0.9
