"""VRPN as a source of the gateway."""

from __future__ import annotations

from flockwire.domain.time import nanoseconds
from flockwire.process.cores import Start
from flockwire.wire.status import counted

from flockwire_mocap.streamed import StreamedSource, coordinates_of
from flockwire_mocap.tracking import SourceState
from flockwire_mocap.vrpn.session import VrpnSession


class VrpnSource(StreamedSource):
    """The bodies that a VRPN server reports. `session` takes the server's bytes in, `arrived` the frames."""

    def __init__(self, start: Start) -> None:
        swarm = start.plan.swarm
        self.table = swarm.gateway.vrpn
        self.session = VrpnSession(f"waits for {self.table.server}:{self.table.port}")
        super().__init__(
            coordinates_of(swarm.gateway),
            self._state,
            nanoseconds(self.table.latency),
            {swarm.body(i): i for i in swarm.tracked},
            1.0 / swarm.gateway.rate_hz,
        )

    def _state(self, now: int) -> SourceState:
        reports, link = self.session.reports, self.session.connection
        counts = counted(
            ("reports repeated", reports.repeated),
            ("reports late", reports.late),
            ("messages malformed", link.malformed),
            ("messages undescribed", link.undescribed),
            ("poses rejected", link.poses_rejected),
        )
        return SourceState(self.session.trouble or self._silence(), counts)

    def _silence(self) -> str:
        if self.session.reports.frames:
            return ""
        where = f"{self.table.server}:{self.table.port}"
        if not self.session.connection.senders:
            return f"{where} answers, but describes no tracker: enable VRPN streaming and bodies in its settings"
        return f"{where} describes {', '.join(sorted(self.session.connection.senders.values()))}, but reports no pose"
