"""Stamps and clocks are integers, in ns of Unix time: a float is not exact enough."""

from __future__ import annotations

from typing import Final, NamedTuple

SECOND: Final = 1_000_000_000  # ns
MICROSECOND: Final = 1000  # ns


def nanoseconds(seconds: float) -> int:
    """Return a time in whole ns; the control path multiplies directly, because a call costs more."""
    return round(seconds * SECOND)


class TimeRequest(NamedTuple):
    """A request for swarm time; the stamp is of the own uncorrected clock (t1)."""

    stamp: int
    frame: str


class TimeReply(NamedTuple):
    """The reply; the stamp is the swarm time of sending (t3)."""

    stamp: int
    frame: str
    requested: int  # the request's stamp (t1)
    received: int  # swarm time of the request's arrival (t2)
