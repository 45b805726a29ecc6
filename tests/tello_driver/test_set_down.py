"""A drone that its driver lands by itself: the same of a Tello and of a simulated airframe without protocol."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from flockwire_core.domain.airframe import Command, FlightState, Telemetry
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND
from flockwire_core.process.driving import RETIREMENT
from flockwire_core.wire.keys import Key
from flockwire_tello.driver import DriverCore
from flockwire_twins.kinematics.core import KinematicsCore
from flockwire_twins.tello.served import ServedTello

BEGAN = 1_790_000_000 * SECOND
TICK = SECOND // 100
CLIMB = (0.0, 0.0, 0.7)
HOVER = (0.0, 0.0, 0.0)


class Simulated:
    """The driver of drone 1, in the process of all simulated airframes."""

    def __init__(self, swarm) -> None:
        self.driver = KinematicsCore(swarm, BEGAN)

    def step(self, now: int) -> list[tuple[Key, object]]:
        return self.driver.step(now)


class Tello:
    """The driver of drone 1, and its simulated Tello."""

    def __init__(self, swarm) -> None:
        self.driver, self._tello = DriverCore(swarm, 1, BEGAN), ServedTello(swarm, 1, BEGAN, lambda: 0.5)

    def step(self, now: int) -> list[tuple[Key, object]]:
        for datagram in self._tello.outgoing(now):
            self.driver.datagram(datagram.data, datagram.source, datagram.target, now)
        self.driver.receive(Key("pose", "uav1"), Pose(now, "world", self._tello.position), now)
        messages = self.driver.step(now)
        for datagram in self.driver.outgoing(now):
            self._tello.datagram(datagram.data, datagram.source, now)
        self._tello.advance(now)
        return [*messages, (Key("truth", "uav1"), Pose(now, "world", self._tello.position))]


class Flight:
    """A drone that hovers; its pilot commands `velocity`, nothing if that is None."""

    def __init__(self, drone: Simulated | Tello) -> None:
        self.now, self.drone = BEGAN, drone
        self.height = 0.0
        self.states: list[FlightState] = []  # as the telemetry has them, each once in a row
        self.velocity: tuple[float, float, float] | None = None
        self.run(1.0)
        self.velocity = CLIMB
        self.run(5.0)
        self.velocity = HOVER
        self.run(1.0)
        assert self.states[-1] is FlightState.FLYING
        self.states.clear()

    def run(self, seconds: float) -> None:
        for _ in range(round(100 * seconds)):
            self.now += TICK
            if self.velocity is not None:
                self.drone.driver.receive(Key("command", "uav1"), Command(self.now, "world", self.velocity), self.now)
            for key, message in self.drone.step(self.now):
                if key == ("truth", "uav1"):
                    self.height = message.position[2]
                elif key == ("telemetry", "uav1") and isinstance(message, Telemetry):
                    self._note(message.state)

    def land(self) -> None:
        """Have its pilot silent until the driver lands it."""
        self.velocity = None
        while not self.states or self.states[-1] is not FlightState.LANDING:
            self.run(0.1)

    def _note(self, state: FlightState) -> None:
        if not self.states or self.states[-1] is not state:
            self.states.append(state)


@pytest.fixture(params=[Simulated, Tello], ids=["simulated", "tello"])
def flight(request: pytest.FixtureRequest, make_swarm: Callable) -> Flight:
    """Return a flight of either airframe."""
    changes = {"limits.speed": 1.0}
    return Flight(
        request.param(make_swarm(changes | ({"drones.1.airframe": "tello"} if request.param is Tello else {})))
    )


DOWN = [FlightState.FLYING, FlightState.LANDING, FlightState.GROUNDED]


def test_its_landing_is_not_taken_back(flight: Flight) -> None:
    flight.land()
    flight.velocity = CLIMB
    flight.run(12.0)
    assert flight.states == DOWN
    assert flight.height == 0.0


def test_it_does_not_take_off_again_for_a_pilot_that_wants_to_climb_all_the_time(flight: Flight) -> None:
    flight.velocity = CLIMB
    flight.run(0.5)
    flight.land()
    flight.run(8.0)
    assert flight.states == DOWN
    flight.velocity = CLIMB
    flight.run(5.0)
    flight.velocity = None
    flight.run(2.0)
    flight.velocity = CLIMB
    flight.run(5.0)
    assert flight.states == DOWN
    assert flight.height == 0.0


def test_it_takes_off_again_for_a_pilot_that_has_stopped_climbing(flight: Flight) -> None:
    flight.land()
    flight.velocity = HOVER
    flight.run(8.0)
    assert flight.states == DOWN
    flight.velocity = CLIMB
    flight.run(5.0)
    assert flight.states == [*DOWN, FlightState.FLYING]
    assert flight.height > 0.8


def test_when_its_process_is_to_end_it_stays_down_for_good(flight: Flight) -> None:
    flight.drone.driver.retire(flight.now)
    flight.run(RETIREMENT / SECOND + 8.0)
    assert flight.states == DOWN
    for flight.velocity in (HOVER, CLIMB):
        flight.run(2.0)
    assert flight.states == DOWN
    assert flight.drone.driver.may_end(flight.now)
