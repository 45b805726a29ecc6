"""The files of one flight's trace: trace.mcap, trace-2.mcap, ..., a part for each start of its recorder.

A recorder that restarts in flight continues in a file beside the first. Nothing is appended to a truncated file: each
part is read up to its end.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain, count, takewhile
from pathlib import Path

FIRST = "trace.mcap"


def parts(trace: Path) -> tuple[Path, ...]:
    """Return `trace`, the first part, and those after it in order."""
    return (trace, *takewhile(Path.exists, further(trace)))


def next_part(folder: Path) -> Path:
    """Return the file for the next recorder of the flight in `folder`."""
    first = folder / FIRST
    return next(path for path in chain((first,), further(first)) if not path.exists())


def further(trace: Path) -> Iterator[Path]:
    """Yield the names of the parts after the first one, `trace`, whether they exist or not."""
    return (trace.with_name(f"{trace.stem}-{number}{trace.suffix}") for number in count(2))
