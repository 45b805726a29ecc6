"""The numbers that a follower's own law records: a Lyapunov function, an event."""

from __future__ import annotations

from typing import Final, NamedTuple

MOST_SIGNALS: Final = 64  # in one message
LONGEST_NAME: Final = 64  # characters


class Signals(NamedTuple):
    """A law's own numbers at one step; nobody but the recorder receives them."""

    stamp: int  # Unix ns, of the step
    frame: str
    values: tuple[tuple[str, float], ...]  # name and number
