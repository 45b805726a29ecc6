"""Pilots and drivers of a swarm behind a session that is none: they obey what is published, at once, and report it."""

from __future__ import annotations

from dataclasses import dataclass

from flockwire import clock
from flockwire.flight.phases import Phase
from flockwire.runtime.subscriptions import Wakeup
from flockwire.swarm.model import uav
from flockwire.wire.inbox import Inbox
from flockwire.wire.keys import ROWS, Key
from flockwire.wire.messages import FlightState, Message, Mission, Stop, Telemetry
from flockwire.wire.plan import Plan
from flockwire.wire.status import Report, Status

GROUND = (Phase.GROUNDED, Phase.READY)


@dataclass
class SimulatedPilot:
    """One pilot with its drone; `deaf`: no order reaches it; `silent`: nobody receives from it; `stays`: obeys not."""

    name: str
    phase: Phase = Phase.READY
    detail: str = ""
    mission: Mission | None = None
    deaf: bool = False
    silent: bool = False
    stays: bool = False

    @property
    def state(self) -> FlightState:
        if self.phase is Phase.STOPPED:
            return FlightState.STOPPED
        return FlightState.GROUNDED if self.phase in GROUND else FlightState.FLYING

    def take(self, order: Mission | Stop) -> None:
        if self.deaf:
            return
        if isinstance(order, Stop):
            self.phase = Phase.STOPPED
        elif self.mission is None or order.stamp > self.mission.stamp:
            without = self.mission.without if self.mission is not None and order.verb == "land" else order.without
            self.mission = order._replace(without=without)

    def fly(self, now: int) -> None:
        """Be where the order leads, without taking time."""
        order = self.mission
        if order is None or self.stays or self.phase is Phase.STOPPED:
            return
        if order.verb in ("land", "prepare"):
            self.phase = Phase.READY
        elif order.in_formation and now >= order.start:
            self.phase = Phase.FORMATION
        else:
            self.phase = Phase.HOLD


class Source:
    """The newest of one key."""

    def __init__(self, swarm: SimulatedSwarm, key: Key) -> None:
        self.inbox, self._swarm = Inbox(key, ROWS[key.kind]), swarm

    def message(self, now: int) -> Status | Telemetry | None:
        return self._swarm.message(self.inbox.key, now)


class SimulatedSwarm:
    """The pilots of `plan`, and what was published to them; stands for a session."""

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        self.pilots = {name: SimulatedPilot(name) for name in plan.pilots.values()}
        self.others = tuple(name for name in plan.started if name not in self.pilots)
        self.published: list[Mission | Stop] = []
        self._drones = {uav(drone): name for drone, name in plan.pilots.items()}

    def __enter__(self) -> SimulatedSwarm:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def __getitem__(self, name: str) -> SimulatedPilot:
        return self.pilots[name]

    def all(self, phase: Phase, mission: Mission | None = None) -> None:
        for pilot in self.pilots.values():
            pilot.phase, pilot.mission = phase, mission

    def newest(self, key: Key) -> Source:
        return Source(self, key)

    def prompt(self, key: Key, wakeup: Wakeup) -> None:
        """Nobody answers who asks for the time."""

    def publish(self, messages: list[tuple[Key, Message]]) -> None:
        orders = [order for _, order in messages if isinstance(order, Mission | Stop)]
        for order in orders:
            self.published.append(order)
            for pilot in self.pilots.values():
                pilot.take(order)

    def message(self, key: Key, now: int) -> Status | Telemetry | None:
        if key.kind == "telemetry":
            pilot = self.pilots[self._drones[key.owner]]
            return None if pilot.silent else Telemetry(now, "world", pilot.state, 1.0, 0.0, 0.0)
        if key.owner in self.others:
            return status(key.owner, Report("serving"), now)
        pilot = self.pilots[key.owner]
        if pilot.silent:
            return None
        pilot.fly(now)
        return status(key.owner, Report(pilot.phase, pilot.detail, mission=pilot.mission), now)

    @property
    def orders(self) -> list[str]:
        """The verbs that were published, without repetitions."""
        verbs = ["stop" if isinstance(order, Stop) else order.verb for order in self.published]
        return [verb for k, verb in enumerate(verbs) if k == 0 or verbs[k - 1] != verb]


def status(identity: str, report: Report, now: int) -> Status:
    return Status(now, "world", identity, report, 0, 0, 0, 0, 0, 0.0, 0, (), ())


def started(formation: str = "", ago: int = 60_000_000_000) -> Mission:
    """Return an order to start that was given a while ago."""
    now = clock.now()
    return Mission(now - ago, "world", "start", now - ago, formation)
