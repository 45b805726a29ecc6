"""A VRPN server as a tracker's twin: each body is a sender that reports its pose."""

from __future__ import annotations

from collections.abc import Iterable

from flockwire_mocap.tracking import TrackerFrame
from flockwire_mocap.twin.stream_server import StreamServer
from flockwire_mocap.vrpn.connection import VrpnConnection
from flockwire_mocap.vrpn.wire import PORT, PoseBody


class VrpnTwin(VrpnConnection):
    """Describes the bodies `names`, then reports their poses; a body that is not tracked is not reported."""

    def __init__(self, names: Iterable[str]) -> None:
        super().__init__()
        for name in names:
            self.describe(name)

    def publish(self, frame: TrackerFrame) -> None:
        """Report the bodies of a frame."""
        for body in frame.bodies:
            if body.tracked:
                name = body.name or str(body.identity)
                self.send_pose(name, frame.captured, PoseBody(0, body.position, body.orientation))


class VrpnServer(StreamServer):
    """Serves the poses of the bodies `names` to VRPN clients; `port` 0 takes a free one."""

    def __init__(self, names: Iterable[str], address: str = "127.0.0.1", port: int = PORT) -> None:
        bodies = tuple(names)
        super().__init__(lambda _: VrpnTwin(bodies), address, port)
