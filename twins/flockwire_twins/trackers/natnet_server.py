"""The sockets of the NatNet twin: one for commands, one for data, as Motive has them."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import Mapping
from typing import Any

from flockwire_core import clock
from flockwire_mocap.natnet.packets import COMMAND_PORT, ServerInfo
from flockwire_mocap.tracking import TrackerFrame

from flockwire_twins.trackers.natnet import NatNetTwin


class NatNetServer(asyncio.DatagramProtocol):
    """Serves frames to NatNet clients.

    Args:
        info: what the server announces; in place of the data port 0 a free one.
        names: of bodies by number.
        address: IPv4 address of the interface to serve on; multicast leaves through it too.
        command_port: where it listens; 0 takes a free one.

    """

    def __init__(
        self,
        info: ServerInfo,
        names: Mapping[int, str],
        address: str = "127.0.0.1",
        command_port: int = COMMAND_PORT,
    ) -> None:
        self._twin, self._address = NatNetTwin(info, names), address
        self.command_port, self.data_port = command_port, info.data_port
        self._commands: asyncio.DatagramTransport | None = None
        self._data: asyncio.DatagramTransport

    async def open(self) -> None:
        """Open both sockets; raises OSError if a port is taken or the address is not there."""
        loop = asyncio.get_running_loop()
        data = self._socket(self.data_port, shared=self._twin.info.multicast)
        data.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(self._address))
        commands = self._socket(self.command_port)
        self.command_port = commands.getsockname()[1]
        self.data_port = data.getsockname()[1]
        self._twin.info = self._twin.info._replace(data_port=self.data_port)
        self._data, _ = await loop.create_datagram_endpoint(asyncio.DatagramProtocol, sock=data)
        self._commands, _ = await loop.create_datagram_endpoint(lambda: self, sock=commands)

    def close(self) -> None:
        """Close both sockets."""
        self._data.close()
        if self._commands is not None:
            self._commands.close()

    def publish(self, frame: TrackerFrame) -> None:
        """Send a frame to the group or to all clients, from the data port."""
        for datagram, target in self._twin.datagrams(frame, clock.now()):
            self._data.sendto(datagram, target)

    def datagram_received(self, data: bytes, addr: tuple[str | Any, int]) -> None:
        """Answer a client."""
        answer = self._twin.receive(data, addr, clock.now())
        if answer is not None and self._commands is not None:
            self._commands.sendto(answer, addr)

    def _socket(self, port: int, shared: bool = False) -> socket.socket:
        """Return a socket; `shared` with clients on this host, which receive the group's datagrams at its port."""
        sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, int(shared))
        sock.setblocking(False)
        sock.bind((self._address, port))
        return sock
