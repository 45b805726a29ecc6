"""A cursor over the bytes of a packet that never reads past their end."""

from __future__ import annotations

from struct import Struct
from typing import Any

from flockwire_mocap.natnet.packets import HEADER

TEXT = "text"
Layout = tuple["int | str | Layout", ...]
"""Fields to pass over: so many bytes; TEXT up to its NUL; an i32 count and as many elements of a layout."""

_INTEGER = Struct("<i")
_SECTION = Struct("<II")


class MalformedError(ValueError):
    """The bytes are malformed; the text gives the reason."""


class PacketReader:
    """Reads `data` from `position` up to `end` (the end of the data by default); raises MalformedError beyond it."""

    __slots__ = ("_data", "_end", "_position")

    def __init__(self, data: bytes, position: int = 0, end: int | None = None) -> None:
        self._data, self._position = data, position
        self._end = len(data) if end is None else end

    @property
    def remaining(self) -> int:
        """How many bytes are left."""
        return self._end - self._position

    def skip(self, size: int) -> int:
        """Pass over `size` bytes; returns where they begin."""
        begin = self._position
        if size < 0 or size > self._end - begin:
            raise MalformedError(f"{size} bytes are announced at {begin}, {self._end - begin} are left")
        self._position = begin + size
        return begin

    def unpack(self, form: Struct) -> tuple[Any, ...]:
        """Read a struct."""
        return form.unpack_from(self._data, self.skip(form.size))

    def integer(self) -> int:
        """Read an i32."""
        value: int = self.unpack(_INTEGER)[0]
        return value

    def count(self, least: int) -> int:
        """Read the number of elements that follow, each at least `least` (1 or more) bytes long."""
        count = self.integer()
        if not 0 <= count * least <= self.remaining:
            raise MalformedError(f"{count} elements are announced, {self.remaining} bytes are left")
        return count

    def pass_over(self, layout: Layout) -> None:
        """Pass over the fields of `layout`."""
        for field in layout:
            if isinstance(field, int):
                self.skip(field)
            elif isinstance(field, str):
                self.text()
            else:
                least = sum(part if isinstance(part, int) else 1 if isinstance(part, str) else 4 for part in field)
                count = self.count(least)
                if field == (least,):  # markers, of which there may be hundreds
                    self.skip(count * least)
                else:
                    for _ in range(count):
                        self.pass_over(field)

    def text(self) -> str:
        """Read text up to its NUL; what is not UTF-8 is replaced."""
        end = self._data.find(b"\0", self._position, self._end)
        if end < 0:
            raise MalformedError(f"the text at {self._position} does not end")
        begin = self.skip(end + 1 - self._position)
        return self._data[begin:end].decode(errors="replace")

    def loose_text(self) -> str:
        """Read text that may end with its NUL or with the packet."""
        if self.remaining > 4096:  # bytes of a response
            raise MalformedError(f"a text of {self.remaining} bytes")
        return self.remainder().partition(b"\0")[0].decode(errors="replace")

    def remainder(self) -> bytes:
        """Read all bytes that are left."""
        begin = self.skip(self.remaining)
        return self._data[begin : self._end]

    def part(self, size: int) -> PacketReader:
        """Return a reader of the next `size` bytes, and pass over them."""
        begin = self.skip(size)
        return PacketReader(self._data, begin, begin + size)

    def section(self) -> tuple[int, PacketReader]:
        """Read a section as from 4.1 on: i32 count, u32 size in bytes; returns the count and a reader of the bytes."""
        count, size = self.unpack(_SECTION)
        return count, self.part(size)


def open_packet(datagram: bytes) -> tuple[int, PacketReader]:
    """Return kind and body; bytes after the announced ones are ignored."""
    reader = PacketReader(datagram)
    kind, length = reader.unpack(HEADER)
    return kind, reader.part(length)
