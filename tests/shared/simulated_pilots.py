"""Pilots and drivers of a swarm behind a session that is none: they obey what is published, at once, and report it."""

from __future__ import annotations

from dataclasses import dataclass, field

from flockwire_core import clock
from flockwire_core.domain.airframe import FlightState, Telemetry
from flockwire_core.domain.order import Mission, Stop
from flockwire_core.ground.order_log import OrderLog
from flockwire_core.pilot.orders import Orders
from flockwire_core.swarm.model import uav
from flockwire_core.wire.codec import Message
from flockwire_core.wire.inbox import Inbox
from flockwire_core.wire.keys import Key
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.processes import GATEWAY, OPERATOR
from flockwire_core.wire.status import Report, Status

GROUND = (Phase.GROUNDED, Phase.READY)


@dataclass
class SimulatedPilot:
    """One pilot with its drone; `deaf`: no order reaches it; `silent`: nobody receives from it; `stays`: obeys not."""

    name: str
    phase: Phase = Phase.READY
    detail: str = ""
    orders: Orders = field(default_factory=Orders)
    deaf: bool = False
    silent: bool = False
    stays: bool = False
    turns_on: bool = False  # after a stop its motors are not known to be off
    told: bool = False  # it has a stop

    @property
    def mission(self) -> Mission | None:
        return self.orders.mission

    @mission.setter
    def mission(self, order: Mission | None) -> None:
        """Have it obey `order` alone for a long time, None: no order."""
        self.orders = Orders()
        if order is not None:
            self.orders.take(order._replace(number=max(order.number, 1)), order.stamp)

    @property
    def state(self) -> FlightState:
        if self.phase is Phase.STOPPED:
            return FlightState.STOPPED
        return FlightState.GROUNDED if self.phase in GROUND else FlightState.FLYING

    def take(self, order: Mission | Stop) -> None:
        if self.deaf:
            return
        if isinstance(order, Stop):
            self.told = True
            self.phase = self.phase if self.turns_on else Phase.STOPPED
        else:
            self.orders.take(order, clock.now())

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
        self.inbox, self._swarm = Inbox(key), swarm

    def messages(self, now: int) -> list[Status | Telemetry]:
        newest = self._swarm.message(self.inbox.key, now)
        return [] if newest is None else [newest]


class SimulatedSwarm:
    """The pilots of `plan`, a gateway, and what was published to them; stands for an operator's session."""

    identity = OPERATOR.kind

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        self.pilots = {name: SimulatedPilot(name) for name in plan.pilots.values()}
        self.others = tuple(name for name in plan.started if name not in self.pilots)
        self.published: list[Mission | Stop] = []
        self._gateway = OrderLog(frozenset(), 0)
        self._drones = {uav(drone): name for drone, name in plan.pilots.items()}

    def __enter__(self) -> SimulatedSwarm:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def __getitem__(self, name: str) -> SimulatedPilot:
        return self.pilots[name]

    def all(self, phase: Phase, mission: Mission | None = None) -> None:
        number = self._gateway.order.number if self._gateway.order is not None else 0
        self._gateway = OrderLog(frozenset(), 0)
        if mission is not None:
            self._gateway.take(mission._replace(number=number), mission.stamp)
        for pilot in self.pilots.values():
            pilot.phase, pilot.mission = phase, self._gateway.order

    def linked(self) -> tuple[str, ...]:
        return self.plan.dials[self.identity]

    def buffered(self, key: Key) -> Source:
        return Source(self, key)

    def publish(self, messages: list[tuple[Key, Message]]) -> None:
        orders = [order for _, order in messages if isinstance(order, Mission | Stop)]
        for order in orders:
            self.published.append(order)
            for pilot in self.pilots.values():
                pilot.take(order)
            if isinstance(order, Mission) and self._gateway.take(order, clock.now()) and self._gateway.order:
                for pilot in self.pilots.values():
                    pilot.take(self._gateway.order)

    def message(self, key: Key, now: int) -> Status | Telemetry | None:
        if key.kind == "telemetry":
            pilot = self.pilots[self._drones[key.owner]]
            return None if pilot.silent else Telemetry(now, "world", pilot.state, 1.0, 0.0, 0.0, pilot.told)
        if key.owner in self.others:
            log, gateway = self._gateway, key.owner == GATEWAY.kind
            report = Report("serving", mission=log.order, order_age=log.age(now)) if gateway else Report("serving")
            return status(key.owner, report, now)
        pilot = self.pilots[key.owner]
        if pilot.silent:
            return None
        pilot.fly(now)
        orders = pilot.orders
        report = Report(
            pilot.phase, pilot.detail, mission=orders.mission, unnumbered=orders.unnumbered, order_age=orders.age(now)
        )
        return status(key.owner, report, now)

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
