"""A trace as tables, for other programs: one for each kind of message, one for the errors, one for events."""

from __future__ import annotations

import csv
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from flockwire.nanoseconds import BILLION
from flockwire.swarm.model import uav

from flockwire_recorder.events import events
from flockwire_recorder.phases import formation_phase
from flockwire_recorder.recorded import Trace
from flockwire_recorder.tracking import formation_errors, observation_errors

_POINT, _VELOCITY = ("x_m", "y_m", "z_m"), ("vx_m_s", "vy_m_s", "vz_m_s")
COLUMNS: dict[str, tuple[str, ...]] = {
    "truth": _POINT,
    "pose": _POINT,
    "estimate": _POINT + _VELOCITY,
    "command": _VELOCITY,
    "telemetry": ("state", "battery", "height_m", "command_age_s"),
}
Table = dict[str, Sequence[Any]]  # columns by name, all of one length


class ExportError(ValueError):
    """What keeps a trace from being exported."""


def tables(trace: Trace) -> Iterator[tuple[str, Table]]:
    """Yield name and columns of each table that has rows.

    `t_s` is mission time in s (time since the trace's begin where no formation was flown), `stamp_ns` Unix time.
    """
    phase = formation_phase(trace)
    origin = phase.begin if phase is not None else trace.begin
    for kind, columns in COLUMNS.items():
        series = [(i, one) for i in sorted({0, *trace.flying}) if len(one := trace.of(kind, i))]
        parts = [(i, one.stamps, one.values) for i, one in series]
        if parts:
            yield kind, _table(parts, columns, origin)
    for name, errors in (
        ("formation_error", formation_errors(trace)),
        ("observation_error", observation_errors(trace)),
    ):
        parts = [(i, one.stamps, one.values[:, None]) for i, one in errors.items() if len(one.stamps)]
        if parts:
            yield name, _table(parts, ("error_m",), origin)
    if found := events(trace):
        stamps = [event.stamp for event in found]
        yield "events", {"t_s": [(s - origin) / BILLION for s in stamps], "stamp_ns": stamps,
                         "event": [event.text for event in found]}  # fmt: skip


def _table(parts: Sequence[tuple[int, Any, Any]], columns: tuple[str, ...], origin: int) -> Table:
    stamps = np.concatenate([stamps for _, stamps, _ in parts])
    values = np.concatenate([values for _, _, values in parts])
    drones = [uav(i) for i, stamps, _ in parts for _ in range(len(stamps))]
    named = {name: values[:, place].tolist() for place, name in enumerate(columns)}
    return {"t_s": ((stamps - origin) / BILLION).tolist(), "stamp_ns": stamps.tolist(), "drone": drones, **named}


def write_csv(trace: Trace, out: Path) -> tuple[Path, ...]:
    """Write each table as a CSV file into the folder `out`; returns the files. Raises OSError."""
    out.mkdir(parents=True, exist_ok=True)
    written = []
    for name, table in tables(trace):
        written.append(out / f"{name}.csv")
        with written[-1].open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(table)
            writer.writerows(zip(*table.values(), strict=True))
    return tuple(written)


def write_parquet(trace: Trace, out: Path) -> tuple[Path, ...]:
    """Write each table as a Parquet file into the folder `out`; returns the files. Raises ExportError, OSError."""
    try:
        import pyarrow  # noqa: PLC0415  (an extra)
        from pyarrow import parquet  # noqa: PLC0415
    except ImportError:
        raise ExportError("--format = 'parquet': needs pyarrow; pip install flockwire[parquet], or take csv") from None
    out.mkdir(parents=True, exist_ok=True)
    written = []
    for name, table in tables(trace):
        written.append(out / f"{name}.parquet")
        parquet.write_table(pyarrow.table(table), written[-1])
    return tuple(written)
