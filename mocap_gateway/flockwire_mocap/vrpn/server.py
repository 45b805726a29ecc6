"""A VRPN server as a tracker's twin."""

from __future__ import annotations

from collections.abc import Iterable

from flockwire_mocap.stream_server import StreamServer
from flockwire_mocap.vrpn.twin import VrpnTwin
from flockwire_mocap.vrpn.wire import PORT


class VrpnServer(StreamServer):
    """Serves the poses of the bodies `names` to VRPN clients; `port` 0 takes a free one."""

    def __init__(self, names: Iterable[str], address: str = "127.0.0.1", port: int = PORT) -> None:
        bodies = tuple(names)
        super().__init__(lambda: VrpnTwin(bodies), address, port)
