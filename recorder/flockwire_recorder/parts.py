"""The parts of a flight's trace: a recorder that is restarted in flight goes on in a file of its own beside the first.

    trace.mcap, trace-2.mcap, trace-3.mcap, ...

Nothing is appended to a file that was cut off: each part is read as far as it goes.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain, count, takewhile
from pathlib import Path

FIRST = "trace.mcap"


def parts(trace: Path) -> tuple[Path, ...]:
    """Return `trace`, the first part, and those after it in order."""
    return (trace, *takewhile(Path.exists, _further(trace)))


def next_part(folder: Path) -> Path:
    """Return the file that the next recorder of the flight in `folder` writes."""
    first = folder / FIRST
    return next(path for path in chain((first,), _further(first)) if not path.exists())


def _further(trace: Path) -> Iterator[Path]:
    return (trace.with_name(f"{trace.stem}-{number}{trace.suffix}") for number in count(2))
