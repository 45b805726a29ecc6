"""The messages of one topic, as numpy arrays: a row for each message."""

from __future__ import annotations

from array import array
from dataclasses import dataclass, field
from math import hypot, inf

import numpy as np
from flockwire_core.domain.airframe import Command, Telemetry
from flockwire_core.domain.body import BodyKind, Nearby
from flockwire_core.domain.motion import Estimate
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.signals import Signals
from flockwire_core.wire.codec import Message
from flockwire_core.wire.keys import ROWS
from numpy.typing import NDArray

Integers = NDArray[np.int64]
Floats = NDArray[np.float64]
Booleans = NDArray[np.bool_]

_WIDTHS: dict[type[Message], int] = {Pose: 3 + 4, Estimate: 6, Command: 3, Telemetry: 4, Nearby: 1}  # columns


NOWHERE = 1e9  # m, m/s: larger values are limited to this, whose square is finite


@dataclass(frozen=True, slots=True)
class Series:
    """The messages of one topic in the order of their stamps, one row each.

    `stamps` (for which the content is valid), `published` and `logged` are Unix times in ns, `sequences` the
    publishers' counts. Columns of `values`, in m, m/s and s: pose and truth x y z; estimate x y z vx vy vz; command vx
    vy vz; telemetry flight state, battery (share of full), height, command age; nearby the distance to the surface of
    the nearest mover, infinite without one; none for the others. Finite ones are at most NOWHERE. `orientations` of
    poses and truth are unit quaternions x y z w, from body to world; other kinds have no columns of them.
    """

    stamps: Integers
    published: Integers
    logged: Integers
    sequences: Integers
    values: Floats
    orientations: Floats = field(default_factory=lambda: np.empty((0, 0)))

    def __len__(self) -> int:
        return len(self.stamps)


@dataclass(frozen=True, slots=True)
class Movers:
    """Moving bodies that are not drones as one drone sensed them, in the order of their stamps.

    `stamps` (Unix ns, shape n) of the drone's pose, and `bodies` (m, shape n x 4): place relative to the drone, radius.
    """

    stamps: Integers
    bodies: Floats


@dataclass(frozen=True, slots=True)
class Signal:
    """One number that a law recorded: `stamps` (Unix ns, ascending) and `values`."""

    stamps: Integers
    values: Floats


class Columns:
    """Collects the rows of one series: the messages of a key of this `kind`, and the moving bodies in them."""

    def __init__(self, kind: str) -> None:
        self._times = array("q")
        self._values = array("d")
        self._width = _WIDTHS.get(ROWS[kind].message, 0)
        self._oriented = ROWS[kind].message is Pose
        self._sensed_at = array("q")
        self._sensed = array("d")
        self._signals: dict[str, tuple[array[int], array[float]]] = {}

    def add(self, message: Message, published: int, logged: int, sequence: int) -> None:
        """Add a message, with its times of publication and logging (Unix ns), and its publisher's count."""
        self._times.extend((message.stamp, published, logged, sequence))
        match message:
            case Pose():
                self._values.extend((*message.position, *message.orientation))
            case Estimate():
                self._values.extend((*message.motion.position, *message.motion.velocity))
            case Command():
                self._values.extend(message.velocity)
            case Telemetry():
                self._values.extend((message.state, message.battery, message.height, message.command_age))
            case Nearby():
                movers = [body for body in message.bodies if body.kind is BodyKind.MOVER]
                for body in movers:
                    self._sensed_at.append(message.stamp)
                    self._sensed.extend((*body.relative_position, body.radius))
                gaps = [hypot(*body.relative_position) - body.radius for body in movers]
                self._values.append(min(gaps, default=inf))
            case Signals():
                for name, value in message.values:
                    stamps, values = self._signals.setdefault(name, (array("q"), array("d")))
                    stamps.append(message.stamp)
                    values.append(value)

    def movers(self) -> Movers:
        """Return the moving bodies in the added messages."""
        stamps = np.array(self._sensed_at, np.int64)
        bodies = np.array(self._sensed, np.float64).reshape(len(stamps), 4).clip(-NOWHERE, NOWHERE)
        order = np.argsort(stamps, kind="stable")
        return Movers(stamps[order], bodies[order])

    def signals(self) -> dict[str, Signal]:
        """Return the numbers in the added messages, by name, in the order of their stamps."""
        found = {}
        for name, (times, values) in sorted(self._signals.items()):
            stamps = np.array(times, np.int64)
            order = np.argsort(stamps, kind="stable")
            found[name] = Signal(stamps[order], np.array(values, np.float64)[order])
        return found

    def series(self) -> Series:
        """Return the added messages, in the order of their stamps."""
        times = np.array(self._times, np.int64).reshape(-1, 4)
        order = np.argsort(times[:, 0], kind="stable")
        rows = np.array(self._values, np.float64).reshape(len(times), self._width)[order]
        values, orientations = np.split(rows, [3 if self._oriented else self._width], axis=1)
        stamps, published, logged, sequences = np.ascontiguousarray(times[order].T)
        np.clip(values, -NOWHERE, NOWHERE, out=values, where=np.isfinite(values))
        return Series(stamps, published, logged, sequences, values, orientations)
