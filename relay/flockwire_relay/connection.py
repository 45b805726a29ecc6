"""One connection through a relay: two sockets, and the bytes from each to the other."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable

from flockwire_relay.direction import END, Direction, Stream


class Side(asyncio.Protocol):
    """One of a connection's two sockets. Its bytes go through `direction` to the other; `lost` is called at its end."""

    other: Side

    def __init__(self, direction: Direction, lost: Callable[[], None]) -> None:
        self._stream = Stream(direction)
        self._lost = lost
        self._loop = asyncio.get_running_loop()
        self._transport: asyncio.Transport | None = None
        self._timer: asyncio.TimerHandle | None = None
        self._ended = self._choked = False
        self.gone = self.over = False  # the socket is closed; the other side has received the end

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Start to pass on the bytes received so far."""
        assert isinstance(transport, asyncio.Transport)  # noqa: S101
        self._transport = transport
        if self.other.gone:
            self.close()
        self.other.pass_on()

    def data_received(self, data: bytes) -> None:
        """Receive bytes."""
        self._stream.take(data, self._loop.time())
        self.pass_on()

    def eof_received(self) -> bool:
        """Receive the end; the other side may continue to send."""
        self._end()
        if not self.other.connected:
            self.close()
        return True

    def connection_lost(self, _: Exception | None) -> None:
        """End the other side too, after all earlier bytes."""
        self.gone = True
        self._end()
        if self.over:
            self.other.close()
        self._lost()

    def pause_writing(self) -> None:
        """Pause: this side accepts no more bytes."""
        self._choked = True

    def resume_writing(self) -> None:
        """Resume: this side accepts bytes."""
        self._choked = False
        self.other.pass_on()

    @property
    def held(self) -> int:
        """The number of its held bytes."""
        return self._stream.size

    @property
    def connected(self) -> bool:
        """Whether the socket is open."""
        return self._transport is not None and not self._transport.is_closing()

    @property
    def ready(self) -> bool:
        """Whether bytes can be written to this side now."""
        return self.connected and not self._choked

    def pass_on(self) -> None:
        """Write the due bytes to the other side, and schedule the next call."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        if self.other.ready:
            for data in self._stream.due(self._loop.time()):
                self.other.write(data)
            later = self._stream.next_arrival()
            if later is not None:
                self._timer = self._loop.call_at(later, self.pass_on)
        if self._transport is not None and not self._ended:
            (self._transport.pause_reading if self._stream.full else self._transport.resume_reading)()

    def write(self, data: bytes) -> None:
        """Write bytes of the other side, or END."""
        if self._transport is None or self._transport.is_closing():
            return
        if data:
            self._transport.write(data)
            return
        self.other.over = True
        if self.other.gone or self.over:
            self.close()
            self.other.close()
        else:
            with contextlib.suppress(OSError):  # the socket was reset: connection_lost follows
                self._transport.write_eof()

    def close(self) -> None:
        """Close the socket as soon as all bytes for it are written."""
        if self._transport is not None:
            self._transport.close()

    def abort(self) -> None:
        """Close the socket at once."""
        if self._timer is not None:
            self._timer.cancel()
        if self._transport is not None:
            self._transport.abort()

    def _end(self) -> None:
        if not self._ended:
            self._ended = True
            self._stream.take(END, self._loop.time())
            self.pass_on()


class Connection:
    """A dialler's connection (`near`) and its connection to the listener, made when `passable` is set."""

    def __init__(
        self,
        there: Direction,
        back: Direction,
        address: tuple[str, int],
        passable: asyncio.Event,
        over: Callable[[Connection], None],
    ) -> None:
        self.near, self.far = Side(there, self._lost), Side(back, self._lost)
        self.near.other, self.far.other = self.far, self.near
        self._over = over
        self._joining = asyncio.create_task(self._join(address, passable))

    def pass_on(self) -> None:
        """Check the held bytes again: the link changed."""
        self.near.pass_on()
        self.far.pass_on()

    def abort(self) -> None:
        """End it at once."""
        self._joining.cancel()
        self.near.abort()
        self.far.abort()

    async def _join(self, address: tuple[str, int], passable: asyncio.Event) -> None:
        await passable.wait()
        try:
            await asyncio.get_running_loop().create_connection(lambda: self.far, *address)
        except OSError:  # no process listens: the dialler tries again
            self.near.abort()

    def _lost(self) -> None:
        if self.near.gone and not self.far.connected:
            self._joining.cancel()
            self._over(self)
