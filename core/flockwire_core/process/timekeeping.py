"""Swarm time: all hosts use the gateway's clock. Processes on other hosts request it and correct their own.

The runner of a core (shell, virtual process) gives it corrected time, and starts it when swarm time is known; only a
driver starts at once. Processes that the gateway's host started share its clock and request nothing; operators request.
"""

from __future__ import annotations

from collections.abc import Callable
from math import inf
from typing import cast

from flockwire_core.domain.time import TimeReply
from flockwire_core.objects import load_object
from flockwire_core.wire.codec import Message
from flockwire_core.wire.keys import TIME_REPLY, TIME_REQUEST, Key
from flockwire_core.wire.plan import Plan

UNKNOWN = -1.0
CORRECTED = "flockwire_core.process.corrected_clock:CorrectedClock"  # of processes on other hosts
PATIENCE = 3.0  # s, longest wait of a process for swarm time; a pilot waits longer

Outgoing = tuple[tuple[Key, Message], ...]


class Timekeeping:
    """The timekeeping of a process that has the swarm's clock; it answers time requests. It receives `keys`."""

    def __init__(self, plan: Plan, identity: str) -> None:
        answered = [key.owner for key in plan.publishes[identity] if key.kind == TIME_REPLY]
        self.keys = frozenset(Key(TIME_REQUEST, owner) for owner in answered)
        self._frame = plan.swarm.frame

    def receive(self, key: Key, message: Message, now: int) -> Outgoing:
        """Receive a message of `keys` at `now`, swarm time in ns; returns messages to publish at once."""
        return ((Key(TIME_REPLY, key.owner), TimeReply(now, self._frame, message.stamp, now)),)

    def step(self, now: int) -> Outgoing:
        """Return the messages to publish at `now`; call it at least ten times a second."""
        return ()

    def figures(self, now: int) -> tuple[float, float]:
        """Return the offset that is corrected and its bound, s; the bound is UNKNOWN before the first replies."""
        return 0.0, 0.0

    def follow(self, corrected: Callable[[int], None]) -> None:
        """Call `corrected` with the ns of each correction that is made at once, from now on."""


def is_known(timed: Timekeeping, now: int) -> bool:
    """Return whether swarm time is known at `now`."""
    return timed.figures(now)[1] >= 0.0


def patience(plan: Plan, identity: str) -> float:
    """Return the longest wait, s, of a process for swarm time before it starts.

    A pilot has no poses either if the gateway is silent, and with a wrong clock it would obey old orders. A driver must
    end setpoints and receive a stop. Any other process starts after a while.
    """
    if identity in plan.pilots.values():
        return inf
    return 0.0 if plan.rows[identity].starts_before_time else PATIENCE


def timekeeping(plan: Plan, identity: str, correct: Callable[[int], None]) -> Timekeeping:
    """Return the timekeeping of `identity`."""
    if Key(TIME_REQUEST, identity) in plan.publishes[identity]:
        return cast("Timekeeping", load_object(CORRECTED)(plan, identity, correct))
    return Timekeeping(plan, identity)
