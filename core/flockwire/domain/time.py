"""Stamps and clocks are integers, in ns of Unix time: a float would not keep them."""

from __future__ import annotations

from typing import Final

SECOND: Final = 1_000_000_000  # ns
MICROSECOND: Final = 1000  # ns


def nanoseconds(seconds: float) -> int:
    """Return a time in whole ns; the control path spells the product out, a call costs more than it."""
    return round(seconds * SECOND)
