"""A QTM server as a tracker's twin."""

from __future__ import annotations

from collections.abc import Iterable

from flockwire_mocap.qualisys.twin import QtmTwin
from flockwire_mocap.qualisys.wire import PORT
from flockwire_mocap.stream_server import StreamServer


class QtmServer(StreamServer):
    """Serves frames to clients of QTM's real-time protocol; `names` of the bodies in the frames' order."""

    def __init__(self, names: Iterable[str], address: str = "127.0.0.1", port: int = PORT) -> None:
        bodies = tuple(names)
        super().__init__(lambda: QtmTwin(bodies), address, port)
