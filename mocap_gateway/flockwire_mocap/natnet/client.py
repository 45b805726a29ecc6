"""A NatNet client: it carries datagrams between its sockets and a `NatNetSession`."""

from __future__ import annotations

import asyncio
import contextlib
import socket
import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractAsyncContextManager

from flockwire_core import clock

from flockwire_mocap.natnet.packets import DATA_PORT, GROUP
from flockwire_mocap.natnet.session import SILENCE
from flockwire_mocap.natnet.source import NatNetSource

BUFFER = 1 << 20  # bytes of the socket's queue: a second of frames and more


def listening(local: str, group: tuple[str, int] | None = None) -> socket.socket:
    """Return a socket on the interface `local`, with any port, or for what is sent to the group (address, port) there.

    Raises OSError if the address is not of this host.
    """
    sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, BUFFER)
        sock.setblocking(False)
        if group is None:
            sock.bind((local, 0))
        else:
            address, port = group
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # others on this host may listen too
            sock.bind(("" if sys.platform == "win32" else address, port))  # nothing else that is sent to the port
            membership = socket.inet_aton(address) + socket.inet_aton(local)
            sock.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, membership)
    except OSError:
        sock.close()
        raise
    return sock


def waiting(sock: socket.socket) -> Iterator[tuple[bytes, str]]:
    """Yield the datagrams that have arrived, each with the address that it came from."""
    for _ in range(512):  # datagrams that are read in a row before other tasks run
        try:
            data, sender = sock.recvfrom(65535)  # bytes of a datagram
        except BlockingIOError:
            return
        except OSError:  # the server's host has refused a datagram (ICMP): it is not there yet
            continue
        yield data, sender[0]


class NatNetClient(AbstractAsyncContextManager[None]):
    """Feeds `source` the frames of its session's server; calls `drained` after all that had arrived.

    A group in the swarm file takes the place of the announced one. Of a server that does not answer it is the
    protocol's default, which the client leaves when a group is announced: another server of the same host may stream to
    it. While frames stay away it joins again: a network adapter that was plugged in again has lost its memberships.
    """

    def __init__(self, source: NatNetSource, drained: Callable[[], None]) -> None:
        self._source, self._session, self._table, self._drained = source, source.session, source.session.table, drained
        self._group = None if self._table.group is None else (self._table.group, self._table.data_port)
        self._sockets: list[socket.socket] = []  # of commands, then of the group
        self._joined: tuple[str, int] | None = None
        self._tried_at = 0  # when it last tried to join, Unix ns
        self._task: asyncio.Task[None]

    async def __aenter__(self) -> None:
        """Open the sockets and start to greet the server; raises OSError if the interface does not exist."""
        interface = self._table.interface
        try:
            self._listen(listening(interface))
            if self._table.multicast and (self._group is not None or self._session.version is not None):
                self._join(self._group or (GROUP, DATA_PORT), clock.now())  # else frames could not be read yet
        except OSError as error:
            raise OSError(f"gateway.natnet.interface = {interface!r}: {error.strerror or error}") from error
        self._task = asyncio.get_running_loop().create_task(self._keep_asking())

    async def __aexit__(self, *_: object) -> None:
        self._task.cancel()
        while self._sockets:
            self._leave(self._sockets[-1])

    def _listen(self, sock: socket.socket) -> None:
        self._sockets.append(sock)
        asyncio.get_running_loop().add_reader(sock, self._readable, sock)

    def _leave(self, sock: socket.socket) -> None:
        self._sockets.remove(sock)
        asyncio.get_running_loop().remove_reader(sock)
        sock.close()

    def _readable(self, sock: socket.socket) -> None:
        for data, sender in waiting(sock):
            now = clock.now()
            frame = self._session.receive(data, sender, now)
            if frame is not None:
                self._source.arrived(frame, now)
        self._drained()

    async def _keep_asking(self) -> None:
        server = (self._table.server, self._table.command_port)
        while True:
            for request in self._session.requests(clock.now()):
                with contextlib.suppress(OSError):  # no route, or refused: reported as silence
                    self._sockets[0].sendto(request, server)
            self._keep_joined(clock.now())
            await asyncio.sleep(0.1)  # s between two checks for datagrams to send

    def _keep_joined(self, now: int) -> None:
        session, group = self._session, self._wanted_group()
        if group is None or (group == self._joined and now - max(self._tried_at, session.framed_at) <= SILENCE):
            return
        try:
            self._join(group, now)
        except OSError as error:
            session.failure = f"cannot join {group[0]}:{group[1]} on {self._table.interface}: {error.strerror or error}"
        else:
            session.failure = None

    def _wanted_group(self) -> tuple[str, int] | None:
        info = self._session.info
        if self._group is None and self._table.multicast and info is not None and info.multicast:
            return info.group, info.data_port
        return self._group or self._joined

    def _join(self, group: tuple[str, int], now: int) -> None:
        self._tried_at = now
        left = self._sockets[1:]
        self._listen(listening(self._table.interface, group))
        self._joined = group
        for sock in left:
            self._leave(sock)
