"""One client's connection to a VRPN server, without a socket: each body is a sender that reports its pose."""

from __future__ import annotations

from collections.abc import Iterable

from flockwire_mocap.tracking import TrackerFrame
from flockwire_mocap.vrpn.connection import VrpnConnection
from flockwire_mocap.vrpn.wire import PoseBody


class VrpnTwin:
    """Describes the bodies `names`, then reports their poses; a body that is not tracked is not reported."""

    def __init__(self, names: Iterable[str]) -> None:
        self._connection = VrpnConnection()
        for name in names:
            self._connection.describe(name)

    @property
    def failed(self) -> bool:
        """Whether the client speaks another protocol."""
        return self._connection.failed is not None

    def receive(self, data: bytes) -> None:
        """Take in bytes as they come, cut anywhere."""
        self._connection.receive(data)

    def publish(self, frame: TrackerFrame) -> None:
        """Report the bodies of a frame."""
        for body in frame.bodies:
            if body.tracked:
                name = body.name or str(body.identity)
                self._connection.send_pose(name, frame.captured, PoseBody(0, body.position, body.orientation))

    def outgoing(self) -> bytes:
        """Return the bytes to be sent since the last call."""
        return self._connection.outgoing()
