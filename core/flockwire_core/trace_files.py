"""The files of one flight's trace: trace.mcap, trace-2.mcap, ..., a part for each start of its recorder."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import count, takewhile
from pathlib import Path


def parts(trace: Path) -> tuple[Path, ...]:
    """Return `trace`, the first part, and those after it in order."""
    return (trace, *takewhile(Path.exists, further(trace)))


def further(trace: Path) -> Iterator[Path]:
    """Yield the names of the parts after the first one, `trace`, whether they exist or not."""
    return (trace.with_name(f"{trace.stem}-{number}{trace.suffix}") for number in count(2))
