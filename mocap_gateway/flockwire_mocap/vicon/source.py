"""Vicon as a source of the gateway: reads the child's lines."""

from __future__ import annotations

import json
from math import isfinite

from flockwire_core.process.cores import Start

from flockwire_mocap.streamed import StreamedSource
from flockwire_mocap.tracking import ReportedBody, TrackerFrame, is_pose

MOST_BODIES = 1000


class ViconSource(StreamedSource):
    """The bodies that a Vicon server reports; `child` is the child's last line that is not a frame: an error."""

    def __init__(self, start: Start) -> None:
        gateway = start.plan.swarm.gateway
        self.table = gateway.vicon
        self.child = ""
        self._numbers: dict[str, int] = {}
        self._lines = 0
        super().__init__(gateway, f"waits for {self.table.server}", self.table.latency)

    def line(self, line: bytes, now: int) -> None:
        """Receive a line of the child, read at `now` (Unix ns): a frame or a text."""
        try:
            frame = json.loads(line)
            if isinstance(frame, str):
                self.child = frame
                return
            came, rows = frame
            if type(came) is not int or not 0 <= came < 1 << 62:  # ns of a monotonic clock: 146 years
                raise ValueError(came)
            bodies = tuple(self._body(str(name), [float(v) for v in row]) for name, row in rows.items())
        except (ValueError, AttributeError, TypeError):
            self.counts["lines malformed"] += 1
            return
        self._lines += 1
        self.failure = ""
        self.arrived(TrackerFrame(self._lines, came, came, bodies), now)

    def _body(self, name: str, row: list[float]) -> ReportedBody:
        x, y, z, qx, qy, qz, qw = row
        if name not in self._numbers and len(self._numbers) >= MOST_BODIES:
            raise ValueError(name)
        number = self._numbers.setdefault(name, len(self._numbers))
        tracked = is_pose((x, y, z), (qx, qy, qz, qw))
        self.counts["poses rejected"] += not tracked and isfinite(x)  # a body that is not seen has no numbers
        return ReportedBody(number, name, (x, y, z), (qx, qy, qz, qw), tracked)
