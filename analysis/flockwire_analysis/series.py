"""The messages of one topic, as numpy arrays: a row for each message."""

from __future__ import annotations

from array import array
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flockwire_analysis.columns import Columns

Integers = NDArray[np.int64]
Floats = NDArray[np.float64]
Booleans = NDArray[np.bool_]
NOWHERE = 1e9  # m, m/s: larger values are limited to this, whose square is finite


@dataclass(frozen=True, slots=True)
class Series:
    """The messages of one topic in the order of their stamps, one row each.

    `stamps` (for which the content is valid), `published` and `logged` are Unix times in ns, `sequences` the
    publishers' counts. Columns of `values`, in m, m/s, m/s^2 and s: pose and truth x y z; estimate x y z vx vy vz;
    command vx vy vz ax ay az; telemetry flight state, battery (share of full), height, command age; nearby the distance
    to the surface of the nearest mover, infinite without one; none for the others. Finite ones are at most NOWHERE.
    `orientations` of poses and truth are unit quaternions x y z w, from body to world; other kinds have none. `size` is
    that of all payloads, bytes.
    """

    stamps: Integers
    published: Integers
    logged: Integers
    sequences: Integers
    values: Floats
    orientations: Floats = field(default_factory=lambda: np.empty((0, 0)))
    size: int = 0

    def __len__(self) -> int:
        return len(self.stamps)


class Samples(NamedTuple):
    """Values at `stamps` (Unix ns, ascending), a row for each.

    Of moving bodies that are not drones as one drone sensed them, m, shape n x 4: place relative to the drone at the
    stamp of its pose, and radius. Of a number that a law recorded: shape n.
    """

    stamps: Integers
    values: Floats


def movers_of(columns: Columns) -> Samples:
    """Return the moving bodies in the added messages."""
    bodies = np.array(columns.sensed, np.float64).reshape(-1, 4).clip(-NOWHERE, NOWHERE)
    return _in_order(columns.sensed_at, bodies)


def signals_of(columns: Columns) -> dict[str, Samples]:
    """Return the numbers in the added messages, by name."""
    return {name: _in_order(times, np.array(values)) for name, (times, values) in sorted(columns.signals.items())}


def _in_order(times: array[int], values: Floats) -> Samples:
    stamps = np.array(times, np.int64)
    order = np.argsort(stamps, kind="stable")
    return Samples(stamps[order], values[order])


def series_of(columns: Columns) -> Series:
    """Return the added messages, in the order of their stamps."""
    rows = np.frombuffer(columns.rows.getvalue(), [("times", "<i8", 4), ("values", "<f8", columns.width)])
    rows = rows[np.argsort(rows["times"][:, 0], kind="stable")]
    values, orientations = np.split(rows["values"], [3 if columns.oriented else columns.width], axis=1)
    stamps, published, logged, sequences = np.ascontiguousarray(rows["times"].T)
    values = np.where(np.isfinite(values), values.clip(-NOWHERE, NOWHERE), values)
    return Series(stamps, published, logged, sequences, values, orientations, columns.size)
