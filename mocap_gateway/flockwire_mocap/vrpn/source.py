"""VRPN as a source of the gateway."""

from __future__ import annotations

from flockwire_core.process.cores import Start

from flockwire_mocap.streamed import StreamedSource
from flockwire_mocap.vrpn.connection import VrpnConnection
from flockwire_mocap.vrpn.reports import Reports


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

    def reconnect(self) -> None:
        """Start another connection."""
        self.connection = VrpnConnection(self.counts)

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
