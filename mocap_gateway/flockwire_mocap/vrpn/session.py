"""The state of a VRPN client over all its connections, without a socket: bytes in, frames and answers out."""

from __future__ import annotations

from flockwire_mocap.tracking import TrackerFrame
from flockwire_mocap.vrpn.connection import VrpnConnection
from flockwire_mocap.vrpn.reports import Reports


class VrpnSession:
    """The state of a server.

    Attributes:
        connection: the newest connection, with what it has counted. reports: of all connections. trouble: the problem
        and its remedy in one line; None while connected.

    """

    def __init__(self, trouble: str | None = None) -> None:
        self.connection, self.reports = VrpnConnection(), Reports()
        self.trouble = trouble

    def reconnect(self) -> None:
        """Start another connection."""
        self.connection = VrpnConnection()

    def receive(self, data: bytes) -> list[TrackerFrame]:
        """Receive bytes of the connection; returns the frames newer than all before, of one body each."""
        frames = [self.reports.frame(pose) for pose in self.connection.receive(data)]
        return [frame for frame in frames if frame is not None]
