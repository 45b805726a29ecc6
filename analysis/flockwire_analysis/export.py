"""A trace as tables, in Python or in files: one for each kind of message, one for the errors, one for events."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator, Sequence
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from flockwire_core.domain.time import SECOND
from flockwire_core.extras import remedy
from flockwire_core.swarm.model import uav

from flockwire_analysis.phases import Span, events, formation_phases, origin
from flockwire_analysis.reading import read_trace
from flockwire_analysis.recorded import Trace
from flockwire_analysis.series import Integers
from flockwire_analysis.tracking import formation_errors, observation_errors

_POINT, _VELOCITY = ("x_m", "y_m", "z_m"), ("vx_m_s", "vy_m_s", "vz_m_s")
_POSE = (*_POINT, "qx", "qy", "qz", "qw")
COLUMNS: dict[str, tuple[str, ...]] = {
    "truth": _POSE,
    "pose": _POSE,
    "estimate": _POINT + _VELOCITY,
    "command": (*_VELOCITY, "ax_m_s2", "ay_m_s2", "az_m_s2"),
    "telemetry": ("state", "battery", "height_m", "command_age_s"),
}
Table = dict[str, Sequence[Any]]  # columns by name, all of one length


class ExportError(ValueError):
    """A trace that cannot be exported."""


def tables(trace: Trace) -> Iterator[tuple[str, Table]]:
    """Yield name and columns of each table that has rows.

    `t_s` is in s from the start of the formation (of the trace if none was flown), `stamp_ns` Unix time. The
    `phase` of an error is the number of summary.json's phase, from 1 on; 0 outside all, as after a hold or in a
    landing. `in_tail` is 1 in the judged part of the phase, else 0.
    """
    zero = origin(trace)
    yield from _messages(trace, zero)
    yield from _errors(trace, zero)
    if trace.signals:
        yield "signals", _signals(trace, zero)
    if found := events(trace):
        stamps, texts = [event.stamp for event in found], [event.text for event in found]
        yield "events", {"t_s": [(s - zero) / SECOND for s in stamps], "stamp_ns": stamps, "event": texts}


def _messages(trace: Trace, zero: int) -> Iterator[tuple[str, Table]]:
    for kind, columns in COLUMNS.items():
        series = [(i, trace.of(kind, i)) for i in sorted({*trace.swarm.leaders, *trace.flying})]
        parts = [(i, one.stamps, np.hstack([one.values, one.orientations])) for i, one in series if len(one)]
        if parts:
            yield kind, _table(parts, columns, zero)


def _errors(trace: Trace, zero: int) -> Iterator[tuple[str, Table]]:
    phases = [phase.span for phase in formation_phases(trace)]
    for name, find in (("formation_error", formation_errors), ("observation_error", observation_errors)):
        parts = [(i, one.stamps, one.values[:, None]) for i, one in find(trace).items() if len(one.stamps)]
        if parts:
            table = _table(parts, ("error_m",), zero)
            yield name, table | _phases(phases, np.array(table["stamp_ns"], np.int64))


def _signals(trace: Trace, zero: int) -> Table:
    named = [(i, name, one) for i, signals in trace.signals.items() for name, one in signals.items()]
    table = _table([(i, one.stamps, one.values[:, None]) for i, _, one in named], ("value",), zero)
    return table | {"signal": [name for _, name, one in named for _ in one.stamps]}


def _table(parts: Sequence[tuple[int, Any, Any]], columns: tuple[str, ...], zero: int) -> Table:
    stamps = np.concatenate([stamps for _, stamps, _ in parts])
    values = np.concatenate([values for _, _, values in parts])
    drones = [uav(i) for i, stamps, _ in parts for _ in range(len(stamps))]
    named = {name: values[:, place].tolist() for place, name in enumerate(columns)}
    return {"t_s": ((stamps - zero) / SECOND).tolist(), "stamp_ns": stamps.tolist(), "drone": drones, **named}


def _phases(phases: Sequence[Span], stamps: Integers) -> Table:
    """Return the columns of the phase of `stamps` (Unix ns), and whether they are in its tail."""
    phase, tail = np.zeros(len(stamps), np.int64), np.zeros(len(stamps), np.int64)
    for number, span in enumerate(phases, 1):
        phase[span.holds(stamps)] = number
        tail[span.tail().holds(stamps)] = 1
    return {"phase": phase.tolist(), "in_tail": tail.tolist()}


def open_trace(trace: str | Path | Trace) -> dict[str, Any]:
    """Return the tables of a trace, or of a file, by name, those that `write_csv` writes.

    Each is a pandas.DataFrame if pandas is installed, else a dict of numpy arrays, one for each column. Either way
    `open_trace(path)["formation_error"]["error_m"]` is a column. Raises ValueError for a file that is not the trace of
    a swarm, OSError for one that cannot be read.
    """
    found = dict(tables(trace if isinstance(trace, Trace) else read_trace(trace)))
    if find_spec("pandas") is None:
        return {name: {key: np.array(column) for key, column in table.items()} for name, table in found.items()}
    frame = import_module("pandas").DataFrame
    return {name: frame(table) for name, table in found.items()}


def write_csv(trace: Trace, out: str | Path) -> tuple[Path, ...]:
    """Write each table as a CSV file into the folder `out`; returns the files. Raises OSError."""

    def write(table: Table, path: Path) -> None:
        with path.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(table)
            writer.writerows(zip(*table.values(), strict=True))

    return _write(trace, Path(out), "csv", write)


def write_parquet(trace: Trace, out: str | Path) -> tuple[Path, ...]:
    """Write each table as a Parquet file into the folder `out`; returns the files. Raises ExportError, OSError."""
    try:
        import pyarrow  # noqa: PLC0415  (an extra)
        from pyarrow import parquet  # noqa: PLC0415
    except ImportError:
        line = f"--format = 'parquet': needs the package pyarrow: {remedy('parquet')} (or take csv)"
        raise ExportError(line) from None
    return _write(trace, Path(out), "parquet", lambda table, path: parquet.write_table(pyarrow.table(table), path))


def _write(trace: Trace, folder: Path, ending: str, write: Callable[[Table, Path], None]) -> tuple[Path, ...]:
    folder.mkdir(parents=True, exist_ok=True)
    written = {folder / f"{name}.{ending}": table for name, table in tables(trace)}
    for path, table in written.items():
        write(table, path)
    return tuple(written)
