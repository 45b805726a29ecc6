"""Stamps and clocks are integers, in ns of Unix time: a float would not keep them."""

from __future__ import annotations

from typing import Final, NamedTuple

SECOND: Final = 1_000_000_000  # ns
MICROSECOND: Final = 1000  # ns


def nanoseconds(seconds: float) -> int:
    """Return a time in whole ns; the control path spells the product out, a call costs more than it."""
    return round(seconds * SECOND)


class TimeRequest(NamedTuple):
    """Asks for the swarm's time; the stamp is by the own clock, uncorrected (t1)."""

    stamp: int
    frame: str


class TimeReply(NamedTuple):
    """The answer; the stamp is the swarm's time when it was sent (t3)."""

    stamp: int
    frame: str
    requested: int  # the request's stamp (t1)
    received: int  # the swarm's time when the request came (t2)
