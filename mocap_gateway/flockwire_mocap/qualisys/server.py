"""A QTM server as a tracker's twin."""

from __future__ import annotations

import contextlib
import socket
from collections.abc import Iterable
from functools import partial

from flockwire_mocap.qualisys.twin import QtmTwin
from flockwire_mocap.qualisys.wire import PORT
from flockwire_mocap.twin.stream_server import StreamServer


class QtmServer(StreamServer):
    """Serves frames to clients of QTM's real-time protocol; `names` of the bodies in the frames' order."""

    def __init__(self, names: Iterable[str], address: str = "127.0.0.1", port: int = PORT) -> None:
        self._names, self._from = tuple(names), address
        self._datagrams: socket.socket | None = None
        super().__init__(lambda host: QtmTwin(self._names, partial(self._send, host)), address, port)

    async def open(self) -> None:
        """Listen; raises OSError if the port is taken or the address is not there."""
        await super().open()
        self._datagrams = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._datagrams.setblocking(False)
        self._datagrams.bind((self._from, 0))

    def close(self) -> None:
        """Close all connections."""
        super().close()
        if self._datagrams is not None:
            self._datagrams.close()
            self._datagrams = None

    def _send(self, host: str, data: bytes, port: int) -> None:
        if self._datagrams is not None:
            with contextlib.suppress(OSError):  # lost: no client, or the frame is too long
                self._datagrams.sendto(data, (host, port))
