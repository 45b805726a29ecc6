"""Operators in virtual time: one runs its core and plans changes of formation, which take no time; one steers."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from flockwire_core.domain.airframe import Steer
from flockwire_core.domain.order import Answer, Mission, Order
from flockwire_core.domain.vector import Vector
from flockwire_core.ground.director import POLL_PERIOD, Director, Stage
from flockwire_core.ground.formation_planning import ChangeRefusedError, plan_in_time
from flockwire_core.ground.operator import OperatorCore
from flockwire_core.process.cores import Ground
from flockwire_core.swarm.model import Swarm, uav
from flockwire_core.wire.codec import Message
from flockwire_core.wire.keys import STEERING, Key
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.status import Report


class VirtualOperator(Ground):
    """Runs `core` for `swarm`; `ordered` is called with each order that is given, `over` at the end of a flight."""

    period = POLL_PERIOD

    def __init__(
        self, core: OperatorCore, swarm: Swarm, ordered: Callable[[Mission], None], over: Callable[[], None]
    ) -> None:
        self.core = core
        self.answers: list[tuple[Order, Answer]] = []
        self._swarm, self._ordered, self._over = swarm, ordered, over
        self._asked: list[Order] = []
        self._ended: Director | None = None  # the directors whose flight has ended

    def receive(self, key: Key, message: Message, now: int) -> None:
        """Receive a status or telemetry."""
        self.core.receive(key, message, now)

    def ask(self, order: Order) -> None:
        """Give `order` from the next step on; its answer is added to `answers`."""
        self._asked.append(order)

    def step(self, now: int) -> list[tuple[Key, Message]]:
        """Give the due orders."""
        asked, self._asked = self._asked, []
        for order in asked:
            self.core.ask(order, now, answered=partial(self._answered, order))
        messages = list(self.core.step(now))
        for _, message in messages:
            if isinstance(message, Mission):
                self._ordered(message)
        self._plan_changes(now)
        director = self.core.director
        if director is not None and director.stage is Stage.OVER and director is not self._ended:
            self._ended = director
            self._over()
        return messages

    def report(self, now: int) -> Report:
        """Return the stage of the flight."""
        return Report(self.core.director.stage if self.core.director is not None else Phase.SERVING)

    def _answered(self, order: Order, answer: Answer) -> None:
        self.answers.append((order, answer))

    def _plan_changes(self, now: int) -> None:
        for given in self.core.to_plan:
            try:
                given.planned(plan_in_time(self._swarm, given, lambda: now))
            except ChangeRefusedError as error:
                given.planned(None, str(error))


Script = Callable[[int], Vector | None]  # the velocity to command at a time (Unix ns), m/s; None: nothing is sent


class ScriptedSteering(Ground):
    """Publishes the commands of `script`, twenty times a second."""

    period = 0.05

    def __init__(self, swarm: Swarm, script: Script) -> None:
        self._swarm, self._script = swarm, script

    def step(self, now: int) -> list[tuple[Key, Message]]:
        """Publish the current velocity."""
        velocity = self._script(now)
        if velocity is None:
            return []
        command = Steer(now, self._swarm.frame, velocity)
        return [(Key(STEERING, uav(number)), command) for number in self._swarm.steered]

    def report(self, now: int) -> Report:
        """Return that it steers."""
        return Report(Phase.STEERING)
