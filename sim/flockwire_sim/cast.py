"""The cores of a swarm by identity: those of the real processes, a twin of the recorder's, and the operator's."""

from __future__ import annotations

from collections.abc import Callable
from random import Random

from flockwire.config import Swarm
from flockwire.director import POLL_PERIOD, Director, Stage
from flockwire.faults import Fault
from flockwire.keys import MISSION, Key
from flockwire.messages import Message, Mission
from flockwire.status import Report, Status
from flockwire.stepping import Core
from flockwire_agent.core import AgentCore
from flockwire_leader.core import FlyingLeader, VirtualLeader
from flockwire_mocap.core import GatewayCore
from flockwire_tello.core import KinematicsCore

RECORDER_PERIOD = 0.02  # s


class OperatorCore:
    """The director, as a core: hears how all are, gives the orders; tells `ordered` of each, `over` of the end."""

    trigger = None
    prompt: frozenset[Key] = frozenset()
    period = POLL_PERIOD

    def __init__(self, director: Director, ordered: Callable[[Mission], None], over: Callable[[], None]) -> None:
        self._director, self._ordered, self._over = director, ordered, over
        self._ended = False
        self._statuses: dict[str, Status] = {}

    def receive(self, _: Key, message: Message, __: int) -> None:
        """Take a status in."""
        if isinstance(message, Status):
            self._statuses[message.identity] = message

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


class RecorderCore:
    """Only tells that it is there: the world itself hands over what is said."""

    trigger = None
    prompt: frozenset[Key] = frozenset()
    period = RECORDER_PERIOD

    def receive(self, _: Key, __: Message, ___: int) -> None:
        """Take nothing in."""

    def step(self, _: int) -> list[tuple[Key, Message]]:
        """Say nothing."""
        return []

    def report(self, _: int) -> Report:
        """Return that it records."""
        return Report("recording")


def make_core(swarm: Swarm, identity: str, now: int, seed: str, faults: tuple[Fault, ...]) -> Core:
    """Return the core of `identity`, begun at `now` (Unix ns of its clock); `seed` is for what it draws by chance."""
    match identity:
        case "gateway":
            return GatewayCore(swarm, Random(seed), faults)  # noqa: S311  (noise)
        case "kinematics":
            return KinematicsCore(swarm, now, faults)
        case "leader":
            return VirtualLeader(swarm, now) if swarm.leader.kind == "virtual" else FlyingLeader(swarm, now)
        case "recorder":
            return RecorderCore()
    return AgentCore(swarm, int(identity.removeprefix("uav")), now)
