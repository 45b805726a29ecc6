"""The operator in virtual time: the director as a core."""

from __future__ import annotations

from collections.abc import Callable

from flockwire.flight.director import POLL_PERIOD, Director, Stage
from flockwire.wire.keys import MISSION, Key
from flockwire.wire.messages import Message, Mission
from flockwire.wire.status import Report, Status


class OperatorCore:
    """Receives how all are and gives the director's orders; calls `ordered` with each, `over` at the end."""

    period = POLL_PERIOD

    def __init__(self, director: Director, ordered: Callable[[Mission], None], over: Callable[[], None]) -> None:
        self.triggers: frozenset[Key] = frozenset()
        self.prompt: frozenset[Key] = frozenset()
        self._director, self._ordered, self._over = director, ordered, over
        self._ended = False
        self._statuses: dict[str, Status] = {}

    def receive(self, _: Key, message: Message, __: int) -> None:
        """Take a status in."""
        if isinstance(message, Status):
            self._statuses[message.identity] = message

    def due(self, _: Key) -> bool:
        """Return False: the operator looks at a rate of its own."""
        return False

    def step(self, now: int) -> list[tuple[Key, Message]]:
        """Give the order that is due."""
        order = self._director.step(self._statuses, now)
        if self._director.stage is Stage.OVER and not self._ended:
            self._ended = True
            self._over()
        if order is None:
            return []
        self._ordered(order)
        return [(MISSION, order)]

    def report(self, _: int) -> Report:
        """Return the stage of the flight."""
        return Report(self._director.stage)
