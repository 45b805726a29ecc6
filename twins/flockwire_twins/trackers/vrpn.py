"""A VRPN server as a tracker's twin: each body is a sender that reports its pose."""

from __future__ import annotations

import asyncio
import contextlib
import re
from collections.abc import Awaitable, Callable, Iterable
from typing import Any

from flockwire_mocap.tracking import TrackerFrame
from flockwire_mocap.vrpn.connection import PORT, PoseBody, VrpnConnection

from flockwire_twins.trackers.stream_server import StreamServer


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


_REQUEST = re.compile(rb"\S{1,255} (\d{1,5})\0?")  # a client's host, and the port where it waits


class VrpnServer(StreamServer):
    """Serves the poses of the bodies `names` to VRPN clients; `port` 0 takes a free one.

    Clients connect by TCP, or request by a datagram to the same port that the server connects to them, as those of the
    reference implementation do unless they are given a tcp:// name.
    """

    def __init__(self, names: Iterable[str], address: str = "127.0.0.1", port: int = PORT) -> None:
        bodies = tuple(names)
        super().__init__(lambda _: VrpnTwin(bodies), address, port)
        self._requests: asyncio.DatagramTransport

    async def open(self) -> None:
        """Listen; raises OSError if the port is taken or the address is not there."""
        await super().open()
        self._requests, _ = await asyncio.get_running_loop().create_datagram_endpoint(
            lambda: _Requests(self.dial), local_addr=(self._address, self.port)
        )

    def close(self) -> None:
        """Close all connections."""
        super().close()
        self._requests.close()


class _Requests(asyncio.DatagramProtocol):
    """Requests of clients to be dialled: only at the host that asks."""

    def __init__(self, dial: Callable[[str, int], Awaitable[None]]) -> None:
        self._dial = dial
        self._dialling: set[asyncio.Task[None]] = set()

    def datagram_received(self, data: bytes, addr: tuple[str | Any, int]) -> None:
        request = _REQUEST.fullmatch(data)
        # clients that are dialled at a time
        if request is not None and 0 < int(request[1]) <= 65535 and len(self._dialling) < 16:
            task = asyncio.ensure_future(self._connect(addr[0], int(request[1])))
            self._dialling.add(task)
            task.add_done_callback(self._dialling.discard)

    async def _connect(self, host: str, port: int) -> None:
        with contextlib.suppress(OSError):  # it waits no more, and will ask again
            await self._dial(host, port)
