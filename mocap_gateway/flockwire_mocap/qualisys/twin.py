"""One client's connection to a QTM server, without a socket: commands in, answers out. The twin of QTM."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from flockwire_mocap.qualisys.wire import (
    COMMAND,
    ERROR,
    HEADER,
    LONGEST,
    encode_event,
    encode_frame,
    encode_parameters,
    encode_text,
)
from flockwire_mocap.tracking import TrackerFrame

CONNECTED = 1  # the event of a server that is ready to stream
VERSIONS = ("1.25", "1.24", "1.23", "1.22", "1.21")


class QtmTwin:
    """What one client has asked for. `failed` where it is no client of this protocol."""

    def __init__(self, names: Iterable[str]) -> None:
        self.failed = self._streams = False
        self._names = tuple(names)
        self._unread = bytearray()
        self._outgoing = bytearray(encode_text(COMMAND, "QTM RT Interface connected"))

    def receive(self, data: bytes) -> None:
        """Take in bytes as they come, cut anywhere."""
        self._unread += data
        while len(self._unread) >= HEADER.size and not self.failed:
            size, kind = HEADER.unpack_from(self._unread)
            if not HEADER.size <= size <= LONGEST:
                self.failed = True
            if self.failed or len(self._unread) < size:
                return
            text = bytes(self._unread[HEADER.size : size]).partition(b"\0")[0].decode(errors="replace")
            del self._unread[:size]
            if kind == COMMAND:
                self._outgoing += self._answer(text)

    def publish(self, frame: TrackerFrame) -> None:
        """Stream a frame, if the client has asked for frames."""
        if self._streams:
            self._outgoing += encode_frame(frame)

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
            return encode_text(COMMAND, f"Version set to {arguments[0]}")
        return encode_text(ERROR, "Version NOT supported")

    def _parameters(self, arguments: list[str]) -> bytes:
        if {"6d", "all"}.intersection(arguments):
            return encode_parameters(self._names)
        return encode_text(ERROR, "Parse error")

    def _stream(self, arguments: list[str]) -> bytes:
        """Begin or end to stream; QTM confirms neither but by the frames."""
        self._streams = "6d" in arguments
        return b"" if self._streams or "stop" in arguments else encode_text(ERROR, "Parse error")
