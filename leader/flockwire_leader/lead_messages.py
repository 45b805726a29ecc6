"""The messages of a leader: a sign that it leads, and to its out-neighbours what the `lead` of the law gives."""

from __future__ import annotations

import logging
from typing import Final

from flockwire_core.control.tracker import AccelerationTracker
from flockwire_core.domain.law_message import Signals
from flockwire_core.domain.motion import LeaderMotion, Motion
from flockwire_core.domain.order import Mission
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import ZERO, Vector, scale, subtract
from flockwire_core.follower_law import raised
from flockwire_core.objects import FAILURES, load_object
from flockwire_core.pilot.senses import LawSender
from flockwire_core.swarm.laws import law_object
from flockwire_core.swarm.model import Swarm, uav
from flockwire_core.wire.codec import Message
from flockwire_core.wire.information import information_of, signs, speakers
from flockwire_core.wire.keys import LEADS, Key
from flockwire_core.wire.law_form import law_form
from flockwire_core.wire.status import LAW_FAILED, Reason

WATCHED: Final = 0.05  # s, of the tracker of a leader without commands
PERIOD: Final = SECOND // 20  # ns between two signs


class LeadMessages:
    """Sends what the law has leader `number` send, if anything; its process was started at `born` (Unix ns).

    If the law relays no estimate of it, it gives every follower a sign while it leads. The sign tells nothing else:
    whoever has no edge from a leader must not learn where it is.
    """

    def __init__(self, swarm: Swarm, number: int, born: int) -> None:
        declared, name = information_of(swarm), uav(number)
        self._name, self._key, self._sign_key, self._frame = name, Key("law", name), Key(LEADS, name), swarm.frame
        self._signs, self._due = number in signs(swarm), 0  # when the next sign is due, Unix ns
        self._form = law_form(declared) if number in speakers(swarm) else None
        self._lead = load_object(law_object(swarm)).lead if self._form is not None else None
        self._sender = LawSender(self._form, declared.pace, swarm.frame, born) if self._form is not None else None
        self.failure: Reason | None = None  # the error of `lead`

    def messages(
        self, mission: Mission | None, motion: LeaderMotion | None, now: int, leads: bool = True
    ) -> list[tuple[Key, Message]]:
        """Return what to publish at `now` (Unix ns) of its `motion` by the order in force, the sign if it `leads`."""
        found = self._sign(leads, now)
        if self._sender is None or self._form is None or self._lead is None or self.failure is not None:
            return found
        data = None
        if motion is not None:
            t = (now - mission.start) / SECOND if mission is not None and mission.in_formation else 0.0
            try:
                data = self._form.pack(self._lead(t, motion))
            except FAILURES as error:
                self.failure = Reason(LAW_FAILED, f"the law failed to lead: {raised(error)}")
                logging.getLogger(self._name).exception(self.failure.text)
        message = self._sender.send(data, now)
        if message is not None:
            found.append((self._key, message))
        return found

    def _sign(self, leads: bool, now: int) -> list[tuple[Key, Message]]:
        if not (self._signs and leads) or now < self._due:
            return []
        self._due = max(self._due, now - PERIOD) + PERIOD  # a step that is late delays no later sign
        return [(self._sign_key, Signals(now, self._frame, ()))]


class FlownMotion:
    """The motion of a leader that flies with an airframe of `lag` s, by its commands."""

    def __init__(self, lag: float) -> None:
        self._lag, self._sent = lag, ZERO  # s; m/s, the command before

    def update(self, motion: Motion | None, sent: Vector, dt: float) -> LeaderMotion | None:
        """Return the motion after the command `sent`, m/s; the acceleration is (u − v) / lag, without lag u's own."""
        before, self._sent = self._sent, sent
        if motion is None:
            return None
        change, time = (motion.velocity, self._lag) if self._lag > 0.0 else (before, dt)
        acceleration = scale(subtract(sent, change), 1.0 / time) if time > 0.0 else ZERO
        return LeaderMotion(motion.position, motion.velocity, acceleration)


class WatchedMotion:
    """The motion of a leader that is a point or a body, by its positions."""

    def __init__(self) -> None:
        self._tracker: AccelerationTracker | None = None
        self._began = 0  # Unix ns

    def update(self, position: Vector, stamp: int) -> LeaderMotion:
        """Return the motion after the `position` (m) at `stamp` (Unix ns)."""
        if self._tracker is None:
            self._tracker, self._began = AccelerationTracker(WATCHED, position, 0.0), stamp
        tracker = self._tracker
        tracker.update(position, (stamp - self._began) / SECOND)
        return LeaderMotion(position, tracker.velocity, tracker.acceleration)
