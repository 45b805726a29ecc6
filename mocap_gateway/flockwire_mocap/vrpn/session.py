"""A client of a VRPN server without a socket, over all its connections: bytes in, frames and answers out."""

from __future__ import annotations

from flockwire_mocap.tracking import TrackerFrame
from flockwire_mocap.vrpn.connection import VrpnConnection
from flockwire_mocap.vrpn.reports import Reports


class VrpnSession:
    """What is known of a server.

    Attributes:
        connection: the newest connection, with what it has counted.
        reports: what came over all connections.
        trouble: why there is no connection, and what to do, in one line; None while there is one.

    """

    def __init__(self, trouble: str | None = None) -> None:
        self.connection, self.reports = VrpnConnection(), Reports()
        self.trouble = trouble

    def reconnect(self) -> None:
        """Begin another connection."""
        self.connection = VrpnConnection()

    def receive(self, data: bytes) -> list[TrackerFrame]:
        """Take in bytes of the connection; returns the frames newer than all before, of one body each."""
        frames = [self.reports.frame(pose) for pose in self.connection.receive(data)]
        return [frame for frame in frames if frame is not None]
