"""Whether all leaders lead: each gives every follower a sign while it does, for laws that relay no estimate of it.

The sign tells nothing else: whoever has no edge from a leader must not learn where it is.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from flockwire_core.domain.law_message import Signals
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.swarm.model import Swarm, uav
from flockwire_core.wire.codec import Message
from flockwire_core.wire.information import signs
from flockwire_core.wire.keys import LEADS, Key

PERIOD: Final = SECOND // 20  # ns between two signs


class LeaderSign:
    """The signs of leader `number`."""

    def __init__(self, swarm: Swarm, number: int) -> None:
        self._key, self._frame, self._needed = Key(LEADS, uav(number)), swarm.frame, number in signs(swarm)
        self._due = 0  # Unix ns

    def messages(self, leads: bool, now: int) -> list[tuple[Key, Message]]:
        """Return the sign to publish at `now` (Unix ns) if it `leads`; empty while none is due."""
        if not (self._needed and leads) or now < self._due:
            return []
        self._due = max(self._due, now - PERIOD) + PERIOD  # a step that is late delays no later sign
        return [(self._key, Signals(now, self._frame, ()))]


class Leadership:
    """The signs that a follower received: one of several leaders that falls silent is enough to stop the formation."""

    def __init__(self, swarm: Swarm) -> None:
        self._limit = nanoseconds(swarm.limits.staleness.leader_silent)
        self._stamps: dict[int, int] = dict.fromkeys(signs(swarm), 0)
        self.handlers: dict[Key, Callable[[Signals], None]] = {Key(LEADS, uav(j)): self._take(j) for j in self._stamps}

    def _take(self, j: int) -> Callable[[Signals], None]:
        def take(sign: Signals) -> None:
            self._stamps[j] = sign.stamp

        return take

    def is_down(self, now: int) -> bool:
        """Return whether a leader that led is silent at `now` (Unix ns)."""
        return any(stamp > 0 and now - stamp > self._limit for stamp in self._stamps.values())
