"""A time that does not jump when the clock is set, or when the process was frozen."""

from __future__ import annotations


class SteadyTime:
    """Counts ns from 0 at `now` (Unix ns); a clock that goes back stops it, and so does a step over `longest` ns."""

    def __init__(self, now: int, longest: int | None = None) -> None:
        self._last, self._time, self._longest = now, 0, longest

    def at(self, now: int) -> int:
        """Return the time at `now`, ns."""
        elapsed, self._last = now - self._last, now
        if elapsed > 0 and (self._longest is None or elapsed <= self._longest):
            self._time += elapsed
        return self._time

    def correct(self, by: int) -> None:
        """Take note that the clock was set forward by `by` ns (back when negative): so much has not passed."""
        self._last += by
