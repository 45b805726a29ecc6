"""A QTM server as a tracker's twin: a client's commands in, answers and frames out, and the sockets round that."""

from __future__ import annotations

import contextlib
import socket
from collections.abc import Callable, Iterable
from functools import partial

from flockwire_mocap.tracking import TrackerFrame

from flockwire_twins.trackers.qualisys_wire import (
    COMMAND,
    COMPONENTS,
    ERROR,
    HEADER,
    LONGEST,
    PORT,
    encode_event,
    encode_frame,
    encode_parameters,
    encode_text,
)
from flockwire_twins.trackers.stream_server import StreamServer

CONNECTED = 1  # the event of a server that is ready to stream
VERSIONS = ("1.25", "1.24", "1.23", "1.22", "1.21", "1.20", "1.19")
HOW_OFTEN = ("allframes", "frequency", "frequencydivisor")  # every frame is sent for any of these


class QtmTwin:
    """One client's requests. `failed`: why it is no client of this protocol, None while it is one.

    `send` sends a datagram to a port of the client's host.
    """

    def __init__(self, names: Iterable[str], send: Callable[[bytes, int], None]) -> None:
        self.failed: str | None = None
        self._send = send
        self._version_set = VERSIONS[0]
        self._components: tuple[int, ...] = ()  # requested components of each frame; empty: no frames
        self._port: int | None = None  # its port for datagrams
        self._names = tuple(names)
        self._unread = bytearray()
        self._outgoing = bytearray(encode_text(COMMAND, "QTM RT Interface connected"))

    def receive(self, data: bytes) -> None:
        """Receive bytes, split anywhere."""
        self._unread += data
        while len(self._unread) >= HEADER.size and self.failed is None:
            size, kind = HEADER.unpack_from(self._unread)
            if not HEADER.size <= size <= LONGEST:
                self.failed = f"a packet of {size} bytes"
            if self.failed is not None or len(self._unread) < size:
                return
            text = bytes(self._unread[HEADER.size : size]).partition(b"\0")[0].decode(errors="replace")
            del self._unread[:size]
            if kind == COMMAND:
                self._outgoing += self._answer(text)

    def publish(self, frame: TrackerFrame) -> None:
        """Stream a frame, if the client has requested frames."""
        if self._components and self._port is not None:
            self._send(encode_frame(frame, self._components), self._port)
        elif self._components:
            self._outgoing += encode_frame(frame, self._components)

    def outgoing(self) -> bytes:
        """Return the bytes to be sent since the last call."""
        data = bytes(self._outgoing)
        self._outgoing.clear()
        return data

    def _answer(self, command: str) -> bytes:
        verb, *arguments = command.lower().split() or [""]
        answers: dict[str, Callable[[list[str]], bytes]] = {
            "version": self._version,
            "qtmversion": lambda _: encode_text(COMMAND, "QTM Version is 2024.1 (flockwire)"),
            "byteorder": lambda _: encode_text(COMMAND, "Byte order is little endian"),
            "getstate": lambda _: encode_event(CONNECTED),
            "getparameters": self._parameters,
            "streamframes": self._stream,
        }
        answer = answers.get(verb)
        return answer(arguments) if answer is not None else encode_text(ERROR, "Parse error")

    def _version(self, arguments: list[str]) -> bytes:
        if len(arguments) == 1 and arguments[0] in VERSIONS:
            self._version_set = arguments[0]
            return encode_text(COMMAND, f"Version set to {arguments[0]}")
        return encode_text(ERROR, "Version NOT supported")

    def _parameters(self, arguments: list[str]) -> bytes:
        if {"6d", "all"}.intersection(arguments):
            return encode_parameters(self._names, self._version_set)
        return encode_text(ERROR, "Parse error")

    def _stream(self, arguments: list[str]) -> bytes:
        """Start or stop streaming; QTM sends no confirmation."""
        self._components, self._port = (), None
        if arguments == ["stop"]:
            return b""
        ports = [text.removeprefix("udp:") for text in arguments if text.startswith("udp:")]
        wanted = [text for text in arguments if text.partition(":")[0] not in (*HOW_OFTEN, "udp")]
        if not wanted or not COMPONENTS.keys() >= set(wanted) or len(ports) > 1 or not all(map(_is_port, ports)):
            return encode_text(ERROR, "Parse error")
        self._components = tuple(COMPONENTS[name] for name in dict.fromkeys(wanted))
        self._port = int(ports[0]) if ports else None
        return b""


def _is_port(text: str) -> bool:
    """Return whether `text` is a port; QTM also accepts an address before it, the twin does not."""
    return text.isascii() and text.isdecimal() and len(text) <= 5 and 0 < int(text) <= 65535


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
