"""An agent that lies within its rights, as a fault: it flies by its own estimate, and publishes another one."""

from __future__ import annotations

from flockwire_core.domain.bids import Bid, Bids
from flockwire_core.domain.motion import Estimate, LeaderMotion, Leading
from flockwire_core.domain.order import Mission
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.domain.vector import add, scale
from flockwire_core.parameters import AgentParameters
from flockwire_core.process.faults import AgentFault, FalseBids, FalseEstimate
from flockwire_core.wire.codec import Message
from flockwire_core.wire.keys import Key

from flockwire_agent.core import AgentCore


class LyingAgent(AgentCore):
    """Publishes what an agent decides, with the estimates changed by `faults`.

    Their times count from `took_off` (Unix ns), or without it from the order to take off.
    """

    def __init__(
        self, parameters: AgentParameters, now: int, faults: tuple[AgentFault, ...], took_off: int | None
    ) -> None:
        super().__init__(parameters, now)
        self._faults, self._took_off = faults, took_off

    def receive(self, key: Key, message: Message, now: int) -> None:
        """Receive a message."""
        if isinstance(message, Mission) and message.verb == "takeoff" and self._took_off is None:
            self._took_off = message.stamp
        super().receive(key, message, now)

    def step(self, now: int) -> list[tuple[Key, Message]]:
        """Return the messages of the agent, with false estimates and bids."""
        return [(key, self._changed(message, now)) for key, message in super().step(now)]

    def _changed(self, message: Message, now: int) -> Message:
        if self._took_off is None or not isinstance(message, Estimate | Bids):
            return message
        t = (now - self._took_off) / SECOND
        for fault in self._faults:
            since = t - fault.at
            if not 0.0 <= since < fault.duration:
                continue
            if isinstance(fault, FalseBids):
                if isinstance(message, Bids):
                    message = message._replace(bids=(Bid(fault.price, fault.drone),) * len(message.bids))
            elif isinstance(message, Bids):
                continue
            elif isinstance(fault, FalseEstimate):
                x, v, a = message.motion.fields()
                motion = LeaderMotion(add(x, scale(fault.velocity, since)), add(v, fault.velocity), a)
                message = message._replace(motion=motion)
            else:
                message = message._replace(origin=now - nanoseconds(fault.age), hops=0, leading=Leading.LEADS)
        return message
