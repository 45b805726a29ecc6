"""The messages of one topic, as they come: a row for each.

Compiled, librt writes numbers without making objects of them: a study collects in half of the time.
"""

from __future__ import annotations

from array import array
from math import hypot, inf
from typing import Final

from flockwire_core.domain.airframe import Command, Telemetry
from flockwire_core.domain.body import BodyKind, Nearby
from flockwire_core.domain.law_message import Signals
from flockwire_core.domain.motion import Estimate
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.vector import Vector
from flockwire_core.wire.codec import Message
from flockwire_core.wire.keys import ROWS
from flockwire_core.wire.status import Status
from librt.strings import BytesWriter, write_f64_le, write_i64_le

_WIDTHS: Final[dict[type[Message], int]] = {  # columns
    Pose: 3 + 4, Estimate: 6, Command: 6, Telemetry: 4, Nearby: 1, Status: 1,
}  # fmt: skip


class Columns:
    """Collects the rows of one series: the messages of a key of this `kind`, and the moving bodies in them.

    `rows` are packed: four integers, stamp, times of publication and logging (Unix ns) and the publisher's count, then
    `width` doubles.
    """

    def __init__(self, kind: str) -> None:
        self.rows, self.size = BytesWriter(), 0  # the size is that of all payloads, bytes
        self.width = _WIDTHS.get(ROWS[kind].message, 0)
        self.oriented = ROWS[kind].message is Pose
        self.sensed_at = array("q")
        self.sensed = array("d")
        self.signals: dict[str, tuple[array[int], array[float]]] = {}

    def add(self, message: Message, published: int, logged: int, sequence: int) -> None:
        """Add a message, with its times of publication and logging (Unix ns), and its publisher's count."""
        stamp, rows = message.stamp, self.rows
        write_i64_le(rows, stamp)
        write_i64_le(rows, published)
        write_i64_le(rows, logged)
        write_i64_le(rows, sequence)
        match message:
            case Pose():
                _write(rows, message.position)
                x, y, z, w = message.orientation
                write_f64_le(rows, x)
                write_f64_le(rows, y)
                write_f64_le(rows, z)
                write_f64_le(rows, w)
            case Estimate():
                _write(rows, message.motion.position)
                _write(rows, message.motion.velocity)
            case Command():
                _write(rows, message.velocity)
                _write(rows, message.acceleration)
            case Telemetry():
                write_f64_le(rows, float(message.state))
                _write(rows, (message.battery, message.height, message.command_age))
            case Status():
                write_f64_le(rows, message.report.formation_error)
            case Nearby():
                movers = [body for body in message.bodies if body.kind is BodyKind.MOVER]
                for body in movers:
                    self.sensed_at.append(stamp)
                    self.sensed.extend((*body.relative_position, body.radius))
                write_f64_le(rows, min([hypot(*body.relative_position) - body.radius for body in movers], default=inf))
        if isinstance(message, Signals):
            for name, value in message.values:
                stamps, values = self.signals.setdefault(name, (array("q"), array("d")))
                stamps.append(stamp)
                values.append(value)


def _write(rows: BytesWriter, v: Vector) -> None:
    write_f64_le(rows, v[0])
    write_f64_le(rows, v[1])
    write_f64_le(rows, v[2])
