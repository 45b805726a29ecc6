"""VRPN as a source of the gateway."""

from __future__ import annotations

from collections import Counter

from flockwire_core.domain.time import SECOND
from flockwire_core.process.cores import Start

from flockwire_mocap.streamed import StreamedSource
from flockwire_mocap.tracking import ReportedBody, TrackerFrame
from flockwire_mocap.vrpn.connection import MOST_NAMES, PoseReport, VrpnConnection

SET_BACK = 3  # older reports of a body in a row that show the same


class Reports:
    """Counts reports: `frames` passed on, in `counts` those dropped. VRPN has no numbers to count gaps with.

    A body has its sender's name; other sensors than 0 of a sender are separate bodies, named sender/sensor.
    """

    def __init__(self, counts: Counter[str]) -> None:
        self.frames = 0
        self._counts = counts
        self._identities: dict[str, int] = {}
        self._newest: dict[int, PoseReport] = {}
        self._behind: Counter[int] = Counter()  # reports of a body in a row that are older than its newest

    def frame(self, report: PoseReport) -> TrackerFrame | None:
        """Return the report as a frame of one body, if it is newer than all before of that body.

        TCP keeps the order: several older stamps in a row come from a clock that was set back.
        """
        sensor = report.pose.sensor
        name = report.name if sensor == 0 else f"{report.name}/{sensor}"
        if name not in self._identities and len(self._identities) >= MOST_NAMES:
            return None
        identity = self._identities.setdefault(name, len(self._identities))
        newest = self._newest.get(identity)
        if newest is not None and not self._is_new(identity, report, newest):
            return None
        set_back = newest is not None and report.stamp < newest.stamp
        self._newest[identity] = report
        self.frames += 1
        body = ReportedBody(identity, name, report.pose.position, report.pose.orientation, tracked=True)
        return TrackerFrame(self.frames, report.stamp, report.stamp, (body,), set_back)

    def _is_new(self, identity: int, report: PoseReport, newest: PoseReport) -> bool:
        behind = newest.stamp - report.stamp
        self._behind[identity] = self._behind[identity] + 1 if behind > 0 else 0
        # ns; a report with an older stamp comes from a clock that was set back
        if behind < 0 or behind > 10 * SECOND or self._behind[identity] >= SET_BACK:
            return True
        repeated = (report.stamp, report.pose) == (newest.stamp, newest.pose)
        self._counts["reports repeated" if repeated else "reports late"] += 1
        return False


class VrpnSource(StreamedSource):
    """The bodies that a VRPN server reports. `connection` is the newest one."""

    def __init__(self, start: Start) -> None:
        swarm = start.plan.swarm
        self.table = swarm.gateway.vrpn
        drones = {swarm.body(i): i for i in swarm.tracked}
        waits = f"waits for {self.table.server}:{self.table.port}"
        super().__init__(swarm.gateway, waits, self.table.latency, drones)
        self._reports = Reports(self.counts)
        self.reconnect()

    def reconnect(self) -> VrpnConnection:
        """Start another connection."""
        self.connection = VrpnConnection(self.counts)
        return self.connection

    def read(self, data: bytes, now: int) -> None:
        """Receive bytes of the connection that arrived at `now` (Unix ns)."""
        for report in self.connection.receive(data):
            frame = self._reports.frame(report)
            if frame is not None:
                self.arrived(frame, now, report.name)  # a server may pass on what other hosts have stamped

    def trouble(self, now: int) -> str:
        """Return why there are no frames, and the remedy; empty while they arrive."""
        if self.failure or self._reports.frames:
            return self.failure
        where, senders = f"{self.table.server}:{self.table.port}", self.connection.senders
        if not senders:
            return f"{where} answers, but describes no tracker: enable VRPN streaming and bodies in its settings"
        return f"{where} describes {', '.join(sorted(senders.values()))}, but reports no pose"
