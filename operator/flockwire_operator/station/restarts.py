"""Restarts the processes of one flight that die in it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable

from flockwire_core.domain.time import SECOND
from flockwire_core.wire.plan import Plan

from flockwire_operator.station.processes import Children

MOST_AT_ONCE = 5  # restarts of one process without a pause
FIRST_PAUSE, LONGEST_PAUSE = SECOND, 60 * SECOND  # ns before a later restart of an optional process; each is doubled


class Restarts:
    """Restarts the children of one flight; `note` gets a line about each restart.

    The process table says which. One that refused its configuration is not restarted. An optional process never ends a
    flight: it is given up if it refused its configuration, and else restarted, after a growing pause from the sixth
    time on. Any other one ends the flight with its sixth death.
    """

    def __init__(self, plan: Plan, children: Children, note: Callable[[str], None]) -> None:
        self._plan, self._children, self._note = plan, children, note
        self._counts: Counter[str] = Counter()  # of restarts, by identity
        self._due: dict[str, int] = {}  # when each of those that wait is restarted, by identity

    def step(self, now: int) -> str:
        """Restart dead processes at `now` (ns); returns a line about one whose death ends the flight, else empty."""
        for identity in self._children.ended():
            self._died(identity, now)
        died = self._children.died()
        for identity in [identity for identity, due in self._due.items() if now >= due]:
            del self._due[identity]
            self._children.start(identity)
        return died

    def _died(self, identity: str, now: int) -> None:
        row, refused = self._plan.rows[identity], self._children.refused(identity)
        more = self._counts[identity] - MOST_AT_ONCE
        pause = min(FIRST_PAUSE << more, LONGEST_PAUSE) if more >= 0 else 0
        if row.optional and (refused or not row.restarts):
            self._note(f"{self._children.how(identity)}; given up, the flight goes on without it")
        elif row.restarts and not refused and (row.optional or not pause):
            self._note(f"{self._children.how(identity)}; restarted{f' in {pause / SECOND:g} s' if pause else ''}")
            self._counts[identity] += 1
            self._due[identity] = now + pause
        else:
            return
        self._children.kill(identity)  # its exit is then expected
