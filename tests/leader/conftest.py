"""A flying leader on an ideal airframe, which receives, step by step, what a gateway and a driver would publish."""

from __future__ import annotations

from collections.abc import Callable
from math import dist, hypot, inf

import pytest
from flockwire_core.control.airframe.first_order_lag import lagged_motion
from flockwire_core.domain.airframe import Command, FlightState, Telemetry
from flockwire_core.domain.body import Body, BodyKind, Nearby
from flockwire_core.domain.order import Mission
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.domain.vector import Vector, add, limit, scale, subtract
from flockwire_core.swarm.model import Swarm
from flockwire_core.wire.keys import MISSION, Key
from flockwire_core.wire.phase import Phase
from flockwire_leader.core import FlyingLeader

BEGAN = 1_790_000_000 * SECOND
TICK = SECOND // 100
STILL = (0.0, 0.0, 0.0)


class Seat:
    """A flying leader; what is `silent` (kinds of keys) does not arrive."""

    def __init__(self, swarm: Swarm) -> None:
        self.now, self.core, self.swarm = BEGAN, FlyingLeader(swarm, 0, BEGAN), swarm
        self.position, self.velocity, self.before = STILL, STILL, STILL
        self.state, self.battery = FlightState.GROUNDED, 1.0
        self.silent: set[str] = set()
        self.commands: list[tuple[Key, Command]] = []  # of the last step
        self.obstacles: list[tuple[Vector, float]] = []  # centre, radius
        self.drones: list[tuple[Vector, Vector]] = []  # where now, velocity
        self.persons: list[tuple[Vector, Vector]] = []  # where now, velocity; 0.4 m of radius
        self.stuck = False  # the airframe stays where it is
        self.closest, self.clearance, self.jump, self.fastest = inf, inf, 0.0, 0.0

    @property
    def phase(self) -> str:
        return self.core.report(self.now).phase

    @property
    def detail(self) -> str:
        return self.core.report(self.now).detail

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds * 100)):
            self.step()

    def step(self) -> None:
        self.now += TICK
        self.drones = [(add(place, scale(v, 0.01)), v) for place, v in self.drones]
        self.persons = [(add(place, scale(v, 0.01)), v) for place, v in self.persons]
        for kind, message in (
            ("telemetry", Telemetry(self.now, "world", self.state, self.battery, self.position[2], 1.0 * self.stuck)),
            ("nearby", Nearby(self.now, "world", self._bodies())),
            ("pose", Pose(self.now, "world", self.position)),
        ):
            if kind not in self.silent:
                self.core.receive(Key(kind, "uav0"), message, self.now)
        self.commands = list(self.core.step(self.now))
        if not self.commands:
            return
        ((key, command),) = self.commands
        assert key == Key("command", "uav0")
        self.before, self.velocity = self.velocity, command.velocity
        self._fly()
        self._measure()

    def push(self, place: Vector) -> None:
        """Let the airframe be pushed to `place` (m), as fast as it can fly."""
        before, self.stuck = self.stuck, True
        while dist(self.position, place) > 1e-9:
            self.position = add(self.position, limit(subtract(place, self.position), 0.1))
            self.step()
        self.stuck = before

    def order(self, verb: str, delay: float = 0.0) -> None:
        was = self.core.report(self.now).mission
        number = was.number + 1 if was is not None else 1
        mission = Mission(self.now + 1, "world", verb, self.now + nanoseconds(delay), number=number)
        self.core.receive(MISSION, mission, self.now)

    def _bodies(self) -> tuple[Body, ...]:
        drones = [Body(BodyKind.DRONE, subtract(place, self.position), 0.0) for place, _ in self.drones]
        x, y, _ = self.position
        fixed = [Body(BodyKind.OBSTACLE, (c[0] - x, c[1] - y, 0.0), radius) for c, radius in self.obstacles]
        movers = [Body(BodyKind.MOVER, (p[0] - x, p[1] - y, 0.0), 0.4, v) for p, v in self.persons]
        return (*drones, *fixed, *movers)

    def _fly(self) -> None:
        if self.velocity[2] > 0.0 and self.state is FlightState.GROUNDED:
            self.state = FlightState.FLYING
        if self.state is FlightState.FLYING and not self.stuck:
            self._move()
            if self.position[2] <= 0.0:
                self.state = FlightState.GROUNDED

    def _move(self) -> None:
        self.position = add(self.position, scale(self.velocity, 0.01))

    def _measure(self) -> None:
        self.fastest = max(self.fastest, hypot(*self.velocity))
        self.jump = max(self.jump, dist(self.velocity, self.before))
        for place, _ in self.drones:
            self.closest = min(self.closest, dist(place, self.position))
        for centre, radius in self.obstacles:
            self.clearance = min(self.clearance, dist(centre[:2], self.position[:2]) - radius)


class LaggingSeat(Seat):
    """A flying leader whose airframe has the lag and the dead time of the swarm file."""

    def __init__(self, swarm: Swarm) -> None:
        super().__init__(swarm)
        airframe = swarm.airframe(0)
        self._lag, self._flown = airframe.lag, STILL
        self._sent = [STILL] * round(airframe.dead_time * 100)

    def _move(self) -> None:
        self._sent.append(self.velocity)
        self.position, self._flown = lagged_motion(self.position, self._flown, self._sent.pop(0), self._lag, 0.01)


@pytest.fixture
def lagging(make_swarm: Callable[..., Swarm]) -> Seat:
    """Return a leader with a Tello's lag and the safety filter, three seconds on its way."""
    airframe = {"airframes.kinematics": {"lag": 0.25, "dead_time": 0.1}}
    return _three_seconds_on_its_way(LaggingSeat(make_swarm({"control.law": "extended", **airframe})))


@pytest.fixture
def seat(make_swarm: Callable[..., Swarm]) -> Callable[..., Seat]:
    """Return the builder of a leader."""
    return lambda changes=None: Seat(make_swarm(changes))


def _three_seconds_on_its_way(leader: Seat) -> Seat:
    leader.run(0.1)
    leader.order("takeoff")
    leader.run(2.0)
    leader.order("start")
    leader.run(3.0)
    assert leader.phase is Phase.FORMATION
    leader.jump = leader.fastest = 0.0
    return leader


@pytest.fixture
def flyer(seat: Callable[..., Seat]) -> Seat:
    """Return a leader under the paper's law, three seconds on its way."""
    return _three_seconds_on_its_way(seat())


@pytest.fixture
def flying(seat: Callable[..., Seat]) -> Callable[..., Seat]:
    """Return the builder of a leader with the safety filter, three seconds on its way."""

    def build(changes: dict[str, object] | None = None, silent: set[str] | None = None) -> Seat:
        leader = seat({"control.law": "extended", **(changes or {})})
        leader.silent = silent or set()
        return _three_seconds_on_its_way(leader)

    return build
