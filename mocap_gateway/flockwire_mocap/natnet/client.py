"""The sockets of a NatNet client: they carry datagrams to and from a `NatNetSession`, and decide nothing."""

from __future__ import annotations

import asyncio
import socket
import sys
from collections.abc import Callable
from typing import Any

from flockwire import clock

from flockwire_mocap.natnet.packets import COMMAND_PORT, DATA_PORT, GROUP
from flockwire_mocap.natnet.session import NatNetSession
from flockwire_mocap.tracking import TrackerFrame

TICK = 0.1  # s between two looks at what is to be sent
BUFFER = 1 << 20  # bytes of the socket's queue: a second of frames and more

Deliver = Callable[[TrackerFrame, int], None]


class NatNetClient(asyncio.DatagramProtocol):
    """Receives the frames of a session's server, and passes each on with the time of its arrival (Unix ns).

    Args:
        session: what to ask, and what is known.
        deliver: called in the event loop with each frame that is newer than all before.
        local: IPv4 address of the interface to send from and to join the group on.
        command_port: the server's.
        group: (address, port) of the multicast group, where it is not what the server announces. For a server that
            does not answer it is the protocol's default, which is left once one is announced: another server of the
            same host may stream to it.

    """

    def __init__(
        self,
        session: NatNetSession,
        deliver: Deliver,
        *,
        local: str = "0.0.0.0",  # noqa: S104 every interface may lead to the server
        command_port: int = COMMAND_PORT,
        group: tuple[str, int] | None = None,
    ) -> None:
        self._session, self._deliver, self._local, self._group = session, deliver, local, group
        self._server = (session.options.server, command_port)
        self._commands: asyncio.DatagramTransport | None = None
        self._joined: tuple[str, int] | None = None
        self._data: asyncio.DatagramTransport | None = None
        self._task: asyncio.Task[None] | None = None

    async def open(self) -> None:
        """Open the sockets and begin to greet the server; raises OSError if the interface is not there."""
        loop = asyncio.get_running_loop()
        sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, BUFFER)
        sock.setblocking(False)
        sock.bind((self._local, 0))
        self._commands, _ = await loop.create_datagram_endpoint(lambda: self, sock=sock)
        if self._session.options.multicast and (self._group is not None or self._session.version is not None):
            await self._join(self._group or (GROUP, DATA_PORT))  # else frames could not be read before the answer
        self._task = loop.create_task(self._keep_asking())

    def close(self) -> None:
        """Close the sockets."""
        if self._task is not None:
            self._task.cancel()
        for transport in (self._commands, self._data):
            if transport is not None:
                transport.close()

    def datagram_received(self, data: bytes, addr: tuple[str | Any, int]) -> None:
        """Take in a datagram from any of the sockets."""
        now = clock.now()
        frame = self._session.receive(data, addr[0], now)
        if frame is not None:
            self._deliver(frame, now)

    async def _keep_asking(self) -> None:
        while self._commands is not None:
            for request in self._session.requests(clock.now()):
                self._commands.sendto(request, self._server)
            info = self._session.info
            if info is not None and info.multicast and self._session.options.multicast and self._group is None:
                await self._join((info.group, info.data_port))
            await asyncio.sleep(TICK)

    async def _join(self, group: tuple[str, int]) -> None:
        """Receive what is sent to a group, and no longer what is sent to the one before."""
        if group == self._joined:
            return
        sock, left = multicast_socket(group, self._local), self._data
        self._data, _ = await asyncio.get_running_loop().create_datagram_endpoint(lambda: self, sock=sock)
        self._joined = group
        if left is not None:
            left.close()


def multicast_socket(group: tuple[str, int], local: str) -> socket.socket:
    """Return a socket that receives what is sent to the group (address, port) on the interface `local`."""
    sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # others on this host may listen too
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, BUFFER)
    sock.setblocking(False)
    address, port = group
    sock.bind(("" if sys.platform == "win32" else address, port))  # by its address: nothing else sent to the port
    membership = socket.inet_aton(address) + socket.inet_aton(local)
    sock.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, membership)
    return sock
