"""Rare branches of links and timers, taken on purpose: late messages, late timers, links closed as an order departs.

A flight has some of them, with shares of its own, as its seed draws them. In a usual flight none is taken.
"""

from __future__ import annotations

from random import Random
from typing import NamedTuple

from flockwire_core.domain.time import nanoseconds

WITHIN = (0.05, 0.3, 1.0)  # s, largest delay or pause of one flight, one of these
SHARES = (0.0003, 0.01)  # smallest and largest share of messages and of timers
TIMER_WITHIN = 0.05  # s, largest delay of a timer


class Rare(NamedTuple):
    """The rare branches of one flight: shares from 0 to 1, largest times in s."""

    late_messages: float = 0.0  # share of the loads of a link that are late; later ones do not overtake them
    late_by: float = 0.0
    late_timers: float = 0.0  # share of the ticks of a process that are late
    closed_links: float = 0.0  # share of the departures of orders and stops at which the link closes, and drops them
    closed_for: float = 0.0

    @classmethod
    def drawn(cls, chance: Random) -> Rare:
        """Draw those of one flight: each kind of branch in half of the flights."""
        late = _share(chance) if chance.random() < 0.5 else 0.0
        late_by = chance.choice(WITHIN)
        timers = _share(chance) if chance.random() < 0.5 else 0.0
        closed = chance.uniform(0.05, 0.5) if chance.random() < 0.5 else 0.0
        return cls(late, late_by, timers, closed, chance.choice(WITHIN))


def _share(chance: Random) -> float:
    least, most = SHARES
    return least * float((most / least) ** chance.random())


class RareBranches:
    """The branches of one link or process, drawn by `chance`."""

    def __init__(self, rare: Rare, chance: Random) -> None:
        self._rare, self._chance = rare, chance
        self._closed = 0  # ns, at the last departure of an event

    def late_message(self) -> int:
        """Return the additional delay of a load, ns; mostly 0."""
        return self._drawn(self._rare.late_messages, self._rare.late_by)

    def late_timer(self) -> int:
        """Return the delay of a tick, ns; mostly 0."""
        return self._drawn(self._rare.late_timers, TIMER_WITHIN)

    def closed(self) -> int:
        """Return for how long the link is closed at the departure of an event, ns; 0: it stays open.

        After it was closed it stays open once: else a stop could wait for ever.
        """
        self._closed = 0 if self._closed else self._drawn(self._rare.closed_links, self._rare.closed_for)
        return self._closed

    def _drawn(self, share: float, within: float) -> int:
        if not share or self._chance.random() >= share:
            return 0
        return nanoseconds(within * (1.0 - self._chance.random()))
