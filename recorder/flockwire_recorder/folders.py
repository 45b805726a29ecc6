"""The folders of a recorder for several flights: one for each start, named by the time.

After a crash it continues in the folder of the truncated trace.
"""

from __future__ import annotations

from datetime import datetime
from pathlib import Path

from flockwire_core.swarm.model import Swarm
from flockwire_core.trace_files import FIRST, parts
from mcap.records import Metadata
from mcap.writer import MCAP0_MAGIC

from flockwire_recorder.records import WholeRecords
from flockwire_recorder.trace import METADATA

SAME_FLIGHT = 600.0  # s after the last record within which a restarted recorder continues the flight


def same_flight(folder: Path, swarm: Swarm, now: datetime) -> bool:
    """Return whether the trace in `folder` is of `swarm` and was written shortly before `now`."""
    try:
        written = max(part.stat().st_mtime for part in parts(folder / FIRST))
    except OSError:
        return False
    described = _described(folder)
    if described is None or now.timestamp() - written > SAME_FLIGHT:
        return False
    return described.metadata.get("swarm") == swarm.model_dump_json()


def dated_folder(out: Path, swarm: Swarm, now: datetime) -> Path:
    """Return the folder below `out` for the recorder of `swarm` that starts at `now`. Raises OSError."""
    newest = newest_folder(out)
    if newest is not None and same_flight(newest, swarm, now) and not _is_closed(parts(newest / FIRST)[-1]):
        return newest
    return out / f"{now:%Y%m%d-%H%M%S}"


def newest_folder(out: Path) -> Path | None:
    """Return the folder below `out` whose trace was begun last, None when there is none: names may be changed."""
    return max((first.parent for first in out.glob(f"*/{FIRST}")), key=_begun, default=None)


def newest_size(out: Path) -> tuple[Path, int] | None:
    """Return the folder whose trace was begun last with the bytes of all its parts, None when there is none."""
    folder = newest_folder(out)
    return None if folder is None else (folder, sum(part.stat().st_size for part in parts(folder / FIRST)))


def _begun(folder: Path) -> tuple[str, Path]:
    """Return when the trace of a folder was begun (UTC, ISO 8601; empty if it does not say), and the folder."""
    described = _described(folder)
    return (described.metadata.get("started", "") if described is not None else "", folder)


def _described(folder: Path) -> Metadata | None:
    """Return what the trace of a folder begins with, None without it."""
    try:
        found = next((record for record in WholeRecords(folder / FIRST) if isinstance(record, Metadata)), None)
    except (OSError, ValueError):
        return None
    return found if found is not None and found.name == METADATA else None


def _is_closed(trace: Path) -> bool:
    """Return whether the trace ends with the magic bytes of MCAP."""
    size = len(MCAP0_MAGIC)
    with trace.open("rb") as stream:
        stream.seek(max(size, trace.stat().st_size - size))
        return stream.read() == MCAP0_MAGIC
