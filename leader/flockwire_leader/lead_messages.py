"""The messages of a leader to its out-neighbours, by the `lead` of the followers' law."""

from __future__ import annotations

import logging

from flockwire_core.domain.motion import LeaderMotion, Motion
from flockwire_core.domain.vector import ZERO, Vector, scale, subtract
from flockwire_core.objects import load_object
from flockwire_core.pilot.law_messages import LawSender
from flockwire_core.swarm.laws import law_object
from flockwire_core.swarm.model import Swarm, uav
from flockwire_core.wire.codec import Message
from flockwire_core.wire.information import information_of, speakers
from flockwire_core.wire.keys import Key
from flockwire_core.wire.law_form import law_form
from flockwire_core.wire.status import LAW_FAILED, Reason


class LeadMessages:
    """Sends what the law has leader `number` send, if anything; its process was started at `born` (Unix ns)."""

    def __init__(self, swarm: Swarm, number: int, born: int) -> None:
        declared, name = information_of(swarm), uav(number)
        self._name, self._key, self._lag = name, Key("law", name), swarm.airframe(number).lag
        self._form = law_form(declared) if number in speakers(swarm) else None
        self._lead = load_object(law_object(swarm)).lead if self._form is not None else None
        self._sender = LawSender(self._form, declared.pace, swarm.frame, born) if self._form is not None else None
        self._sent: Vector = ZERO  # m/s, the command before
        self.failure: Reason | None = None  # the error of `lead`

    def messages(self, t: float, motion: Motion | None, sent: Vector, dt: float, now: int) -> list[tuple[Key, Message]]:
        """Return what to publish at `now` (Unix ns), `t` s after time 0; `sent` (m/s) is the command of this step.

        The acceleration is that of the airframe's model, (u − v) / lag; without lag the command's.
        """
        if self._sender is None or self._form is None or self._lead is None or self.failure is not None:
            return []
        data = None
        if motion is not None:
            change, time = (motion.velocity, self._lag) if self._lag > 0.0 else (self._sent, dt)
            acceleration = scale(subtract(sent, change), 1.0 / time) if time > 0.0 else ZERO
            try:
                data = self._form.pack(self._lead(t, LeaderMotion(motion.position, motion.velocity, acceleration)))
            except Exception as error:  # the law may be a user's
                self.failure = Reason(LAW_FAILED, f"the law failed to lead: {type(error).__name__}: {error}")
                logging.getLogger(self._name).exception(self.failure.text)
        self._sent = sent
        message = self._sender.send(data, now)
        return [(self._key, message)] if message is not None else []
