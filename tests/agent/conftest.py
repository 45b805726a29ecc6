"""An agent that is told, step by step, what its swarm would tell it."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from flockwire.config import Swarm
from flockwire.control.vector import Vector, add, scale
from flockwire.flight import BILLION, Phase
from flockwire.keys import MISSION, STOP, Key, uav
from flockwire.messages import Body, Command, Estimate, FlightState, Mission, Nearby, Pose, Report, Stop, Telemetry
from flockwire_agent.core import AgentCore

BEGAN = 1_790_000_000 * BILLION
TICK = BILLION // 100


class Cockpit:
    """Agent `number` with an ideal airframe, x' = u; whoever is in `silent` (kinds, or owners) is not heard."""

    def __init__(self, swarm: Swarm, number: int, position: Vector = (3.0, 0.0, 0.0)) -> None:
        self.now, self.swarm, self.number = BEGAN, swarm, number
        self.core = AgentCore(swarm, number, BEGAN)
        self.position, self.leader = position, (0.0, 0.0, 1.0)
        self.state, self.battery = FlightState.GROUNDED, 1.0
        self.bodies: tuple[Body, ...] = ()
        self.silent: set[str] = set()
        self.holds_still = False  # the airframe stays where it is, whatever is commanded
        self.command: Command | None = None
        self.estimate: Estimate | None = None

    @property
    def velocity(self) -> Vector:
        assert self.command is not None
        return self.command.velocity

    @property
    def report(self) -> Report:
        return self.core.report(self.now)

    @property
    def phase(self) -> str:
        return self.report.phase

    def tell(self) -> None:
        """Tell the agent all that is not silent, true for now."""
        own, now = uav(self.number), self.now
        telemetry = Telemetry(now, "world", self.state, self.battery, self.position[2], 0.0)
        told = {
            Key("nearby", own): Nearby(now, "world", self.bodies),
            Key("telemetry", own): telemetry,
            Key("pose", own): Pose(now, "world", self.position),
        }
        for j in self.swarm.topology.neighbours(self.number):
            said = Estimate(now, "world", self.leader, (0.0, 0.0, 0.0)) if j else Pose(now, "world", self.leader)
            told[Key("estimate" if j else "pose", uav(j))] = said
        for key, message in told.items():
            if not ({key.kind, key.owner} & self.silent if key.owner != own else key.kind in self.silent):
                self.core.receive(key, message, now)

    def step(self) -> None:
        """Let one period pass."""
        self.now += TICK
        self.tell()
        messages = dict(self.core.step(self.now))
        command, estimate = messages[Key("command", uav(self.number))], messages.get(Key("estimate", uav(self.number)))
        assert isinstance(command, Command)
        self.command, self.estimate = command, estimate
        if command.velocity[2] > 0.0 and self.state is FlightState.GROUNDED:
            self.state = FlightState.FLYING
        if self.state is FlightState.FLYING and not self.holds_still:
            self.position = add(self.position, scale(command.velocity, 0.01))
            if self.position[2] <= 0.0:
                self.state = FlightState.GROUNDED

    def run(self, seconds: float) -> None:
        """Let `seconds` pass."""
        for _ in range(round(seconds * 100)):
            self.step()

    def order(self, verb: str, start: int = 0, formation: str = "") -> None:
        self.core.receive(MISSION, Mission(self.now + 1, "world", verb, start, formation), self.now)

    def stop(self) -> None:
        self.core.receive(STOP, Stop(self.now, "world", "test"), self.now)

    def fly(self) -> Cockpit:
        """Bring the agent into formation, and keep the airframe where it is from then on."""
        self.run(0.1)
        self.order("takeoff")
        self.run(2.0)
        self.order("start", self.now)
        self.run(3.0)
        assert self.phase is Phase.FORMATION
        self.holds_still = True
        return self


@pytest.fixture
def cockpit(make_swarm) -> Callable[..., Cockpit]:
    """Return the builder of an agent; its first neighbour is the leader unless `number` says otherwise."""

    def build(changes: dict[str, object] | None = None, number: int = 1, **more: Vector) -> Cockpit:
        return Cockpit(make_swarm(changes), number, **more)

    return build
