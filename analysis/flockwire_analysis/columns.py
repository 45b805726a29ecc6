"""The messages of one topic, as they come: a row for each."""

from __future__ import annotations

from array import array
from math import hypot, inf
from struct import Struct
from typing import Final

from flockwire_core.domain.airframe import Command, Telemetry
from flockwire_core.domain.body import BodyKind, Nearby
from flockwire_core.domain.motion import Estimate
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.signals import Signals
from flockwire_core.wire.codec import Message
from flockwire_core.wire.keys import ROWS
from flockwire_core.wire.status import Status

_WIDTHS: Final[dict[type[Message], int]] = {  # columns
    Pose: 3 + 4, Estimate: 6, Command: 6, Telemetry: 4, Nearby: 1, Status: 1,
}  # fmt: skip


class Columns:
    """Collects the rows of one series: the messages of a key of this `kind`, and the moving bodies in them.

    `rows` are packed: four integers, stamp, times of publication and logging (Unix ns) and the publisher's count, then
    `width` doubles.
    """

    def __init__(self, kind: str) -> None:
        self.rows, self.size = bytearray(), 0  # the size is that of all payloads, bytes
        self.width = _WIDTHS.get(ROWS[kind].message, 0)
        self.oriented = ROWS[kind].message is Pose
        self.sensed_at = array("q")
        self.sensed = array("d")
        self.signals: dict[str, tuple[array[int], array[float]]] = {}
        self._pack = Struct(f"<4q{self.width}d").pack

    def add(self, message: Message, published: int, logged: int, sequence: int) -> None:
        """Add a message, with its times of publication and logging (Unix ns), and its publisher's count."""
        stamp, pack = message.stamp, self._pack
        match message:
            case Pose():
                (x, y, z), (i, j, k, w) = message.position, message.orientation
                self.rows += pack(stamp, published, logged, sequence, x, y, z, i, j, k, w)
            case Estimate():
                (x, y, z), (vx, vy, vz) = message.motion.position, message.motion.velocity
                self.rows += pack(stamp, published, logged, sequence, x, y, z, vx, vy, vz)
            case Command():
                (vx, vy, vz), (ax, ay, az) = message.velocity, message.acceleration
                self.rows += pack(stamp, published, logged, sequence, vx, vy, vz, ax, ay, az)
            case Telemetry():
                reported = (float(message.state), message.battery, message.height, message.command_age)
                self.rows += pack(stamp, published, logged, sequence, *reported)
            case Status():
                self.rows += pack(stamp, published, logged, sequence, message.report.formation_error)
            case Nearby():
                movers = [body for body in message.bodies if body.kind is BodyKind.MOVER]
                for body in movers:
                    self.sensed_at.append(stamp)
                    self.sensed.extend((*body.relative_position, body.radius))
                gaps = [hypot(*body.relative_position) - body.radius for body in movers]
                self.rows += pack(stamp, published, logged, sequence, min(gaps, default=inf))
            case _:
                self.rows += pack(stamp, published, logged, sequence)
        if isinstance(message, Signals):
            for name, value in message.values:
                stamps, values = self.signals.setdefault(name, (array("q"), array("d")))
                stamps.append(stamp)
                values.append(value)
