"""Marks: what a campaign of flights must reach sometimes; marks.txt lists them.

    sometimes("director: takes off")

A mark stands at an event, or on a rare branch, never at what each step does. It is counted only within `marked`.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Final

_counts: Final[ContextVar[dict[str, int] | None]] = ContextVar("marks", default=None)


def sometimes(mark: str) -> None:
    """Count that `mark` was reached."""
    counts = _counts.get()
    if counts is not None:
        counts[mark] = counts.get(mark, 0) + 1


@contextmanager
def marked() -> Iterator[dict[str, int]]:
    """Count the marks that this thread reaches within the block: the number of times by mark."""
    counts: dict[str, int] = {}
    before = _counts.set(counts)
    try:
        yield counts
    finally:
        _counts.reset(before)


class Holding:
    """Counts each of some marks when it begins to hold: what holds at two updates in turn is one event."""

    def __init__(self) -> None:
        self.marks: tuple[str, ...] = ()

    def update(self, marks: tuple[str, ...]) -> None:
        """Record that just `marks` hold now."""
        if marks != self.marks:
            for mark in marks:
                if mark not in self.marks:
                    sometimes(mark)
            self.marks = marks
