"""VRPN as a source of the gateway."""

from __future__ import annotations

from collections import Counter

from flockwire.process.cores import Start

from flockwire_mocap.streamed import StreamedSource
from flockwire_mocap.vrpn.connection import VrpnConnection
from flockwire_mocap.vrpn.reports import Reports


class VrpnSource(StreamedSource):
    """The bodies that a VRPN server reports.

    Attributes:
        connection: the newest one.
        failure: the problem and its remedy in one line; empty while connected.

    """

    def __init__(self, start: Start) -> None:
        swarm = start.plan.swarm
        self.table = swarm.gateway.vrpn
        self.failure = f"waits for {self.table.server}:{self.table.port}"
        self._counts = Counter[str]()
        self._reports = Reports(self._counts)
        self.reconnect()
        drones = {swarm.body(i): i for i in swarm.tracked}
        super().__init__(
            swarm.gateway, lambda _: self.failure or self._silence(), self._counts, self.table.latency, drones
        )

    def reconnect(self) -> None:
        """Start another connection."""
        self.connection = VrpnConnection(self._counts)

    def read(self, data: bytes, now: int) -> None:
        """Receive bytes of the connection that arrived at `now` (Unix ns)."""
        for report in self.connection.receive(data):
            frame = self._reports.frame(report)
            if frame is not None:
                self.arrived(frame, now)

    def _silence(self) -> str:
        if self._reports.frames:
            return ""
        where, senders = f"{self.table.server}:{self.table.port}", self.connection.senders
        if not senders:
            return f"{where} answers, but describes no tracker: enable VRPN streaming and bodies in its settings"
        return f"{where} describes {', '.join(sorted(senders.values()))}, but reports no pose"
