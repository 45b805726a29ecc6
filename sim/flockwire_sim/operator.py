"""The operator in virtual time: the director as a core."""

from __future__ import annotations

from collections.abc import Callable

from flockwire.flight.cores import Ground
from flockwire.flight.director import POLL_PERIOD, STOP_FOR, Director, Stage
from flockwire.swarm.model import uav
from flockwire.wire.keys import MISSION, STOP, Key
from flockwire.wire.messages import Message, Mission, Stop, Telemetry
from flockwire.wire.plan import Plan
from flockwire.wire.status import Report, Status


class OperatorCore(Ground):
    """Receives how all are and gives the director's orders; calls `ordered` with each, `over` at the end."""

    period = POLL_PERIOD

    def __init__(
        self, plan: Plan, director: Director, ordered: Callable[[Mission], None], over: Callable[[], None]
    ) -> None:
        super().__init__()
        self._director, self._ordered, self._over = director, ordered, over
        self._ended = False
        self._frame = plan.swarm.frame
        self._stop: str | None = None  # why all motors are to stop
        self._stop_until = 0  # Unix ns
        self._statuses: dict[str, Status] = {}
        self._telemetry: dict[int, Telemetry] = {}
        self._drones = {uav(drone): drone for drone in plan.pilots}

    def receive(self, key: Key, message: Message, now: int) -> None:
        """Take a status or telemetry in."""
        if isinstance(message, Status):
            self._statuses[message.identity] = message
        elif isinstance(message, Telemetry):
            self._telemetry[self._drones[key.owner]] = message

    def stop(self, reason: str) -> None:
        """Order an emergency stop because of `reason`."""
        self._stop = reason

    def step(self, now: int) -> list[tuple[Key, Message]]:
        """Give the orders that are due."""
        orders = self._stops(now)
        order = self._director.step(self._statuses, self._telemetry, now)
        if self._director.stage is Stage.OVER and not self._ended:
            self._ended = True
            self._over()
        if order is not None:
            self._ordered(order)
            orders.append((MISSION, order))
        return orders

    def _stops(self, now: int) -> list[tuple[Key, Message]]:
        if self._stop is None:
            return []
        if not self._stop_until:
            self._stop_until = now + STOP_FOR
            self._director.stop(now)
        return [(STOP, Stop(now, self._frame, self._stop))] if now < self._stop_until else []

    def report(self, now: int) -> Report:
        """Return the stage of the flight."""
        return Report(self._director.stage)
