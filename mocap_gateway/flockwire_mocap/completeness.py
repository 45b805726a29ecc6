"""Completes frames whose bodies are reported one by one, by one or several processes, in any order.

A report completes the frame when

1. every body that has been reporting lately has reported since the last frame, each less than about a period ago;
2. some have not, but the reporting body completed the last frame too: it comes last, so what is missing was lost;
3. it is the body's third since the last frame (`MISSED_FRAMES`): the one that used to come last no longer reports.

A body that is missing from `MISSED_FRAMES` frames in a row, or in case 3, is not waited for until it reports again.

The age in rule 1 keeps the reports of one process together: otherwise a frame could end between two of them and contain
some that are a period old. n bodies that report once a period leave a gap of at least 1/n period between two reports,
so a maximum age of 1 - 1/(2n) periods can always be kept, with jitter of 1/(2n) periods.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from flockwire_core.domain.time import SECOND

MISSED_FRAMES: Final = 3


class Completeness:
    """Completes frames of `bodies`, each of which reports once per `period` (s).

    At first it waits for all, and expects them in their order.
    """

    def __init__(self, bodies: Sequence[int], period: float) -> None:
        self._awaited = set(bodies)
        self._missing = set(self._awaited)  # expected bodies that have not reported since the last frame
        self._maximum_age = round(period * (1.0 - 0.5 / len(self._awaited)) * SECOND)
        self._times: dict[int, int] = {}  # of the newest report since the last frame
        self._counts: dict[int, int] = {}  # of reports since the last frame
        self._missed: dict[int, int] = {}  # frames in a row, by body
        self._last = bodies[-1]  # the body that completed the last frame

    def report(self, body: int, now: int) -> bool:
        """Return whether the report of `body` that arrived at `now` (ns) completes a frame; the next begins another."""
        self._awaited.add(body)
        self._missing.discard(body)
        if self._missed:
            self._missed.pop(body, None)
        self._times[body] = now
        count = self._counts[body] = self._counts.get(body, 0) + 1
        if count >= MISSED_FRAMES:
            self._awaited -= self._missing
            self._missing.clear()
        elif self._missing:
            if body != self._last:
                return False
        elif now - min(self._times.values()) > self._maximum_age:
            return False
        self._begin(body)
        return True

    def _begin(self, last: int) -> None:
        """Begin the frame after the one that `last` completed."""
        for body in self._missing:
            missed = self._missed[body] = self._missed.get(body, 0) + 1
            if missed >= MISSED_FRAMES:
                self._awaited.discard(body)
        self._last, self._missing = last, set(self._awaited)
        self._times.clear()
        self._counts.clear()
