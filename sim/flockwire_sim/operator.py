"""The operator in virtual time: the director as a core."""

from __future__ import annotations

from collections.abc import Callable

from flockwire.flight.cores import Ground
from flockwire.flight.director import POLL_PERIOD, Director, Stage
from flockwire.swarm.model import uav
from flockwire.wire.keys import MISSION, Key
from flockwire.wire.messages import Message, Mission, Telemetry
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
        self._statuses: dict[str, Status] = {}
        self._telemetry: dict[int, Telemetry] = {}
        self._drones = {uav(drone): drone for drone in plan.pilots}

    def receive(self, key: Key, message: Message, now: int) -> None:
        """Take a status or telemetry in."""
        if isinstance(message, Status):
            self._statuses[message.identity] = message
        elif isinstance(message, Telemetry):
            self._telemetry[self._drones[key.owner]] = message

    def step(self, now: int) -> list[tuple[Key, Message]]:
        """Give the order that is due."""
        order = self._director.step(self._statuses, self._telemetry, now)
        if self._director.stage is Stage.OVER and not self._ended:
            self._ended = True
            self._over()
        if order is None:
            return []
        self._ordered(order)
        return [(MISSION, order)]

    def report(self, now: int) -> Report:
        """Return the stage of the flight."""
        return Report(self._director.stage)
