"""The folders of a recorder that outlasts flights: one named by the time for each time that it is started.

One that its supervisor starts again after a crash goes on in the folder of its trace, which was cut off (parts.py).
"""

from __future__ import annotations

from datetime import datetime
from pathlib import Path

from flockwire.swarm.model import Swarm
from mcap.writer import MCAP0_MAGIC

from flockwire_recorder.parts import FIRST, parts, same_flight


def dated_folder(out: Path, swarm: Swarm, now: datetime) -> Path:
    """Return the folder below `out` for the recorder of `swarm` that starts at `now`. Raises OSError."""
    newest = newest_folder(out)
    if newest is not None and same_flight(newest, swarm, now) and not _closed(parts(newest / FIRST)[-1]):
        return newest
    return out / f"{now:%Y%m%d-%H%M%S}"


def newest_folder(out: Path) -> Path | None:
    """Return the newest folder below `out` with a trace, None when there is none."""
    return max((first.parent for first in out.glob(f"*/{FIRST}")), default=None)


def _closed(trace: Path) -> bool:
    """Return whether the trace ends with the bytes that it begins with: those of MCAP."""
    size = len(MCAP0_MAGIC)
    with trace.open("rb") as stream:
        stream.seek(max(size, trace.stat().st_size - size))
        return stream.read() == MCAP0_MAGIC
