"""Stamps and clocks are integers, in ns of Unix time: a float would not keep them."""

from __future__ import annotations

from typing import Final

BILLION: Final = 1_000_000_000  # ns in a second
THOUSAND: Final = 1000  # ns in a microsecond
