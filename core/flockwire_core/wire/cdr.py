"""CDR of ROS 2: little-endian XCDR1, alignment counted from the end of the 4-byte header.

Source: OMG Common Data Representation (formal/2002-06-51 section 15.3), RTPS 2.3 section 10.2 for the header.
`Writer` and `Reader` serve all messages but those of the 100 Hz path (stamped.py).
"""

from __future__ import annotations

from functools import lru_cache
from struct import Struct, error
from typing import Any, Final

from librt.strings import (
    BytesWriter,
    read_f64_le,
    read_i32_le,
    read_i64_le,
    write_f64_le,
    write_i32_le,
    write_i64_le,
)

from flockwire_core.domain.time import SECOND

HEADER: Final = b"\x00\x01\x00\x00"  # little-endian CDR
LONGEST_SEQUENCE: Final = 4096
_ONE: Final = {code: Struct(f"<{code}") for code in "BHiIQdf"}  # the numbers that messages hold
_SIZES: Final = {code: form.size for code, form in _ONE.items()}
MOST: Final = 0xFFFF_FFFF  # largest number of 32 bits
MOST_LONG: Final = 0xFFFF_FFFF_FFFF_FFFF


class MessageError(ValueError):
    """Bytes that are not a message of the expected kind."""


def too_short(data: bytes) -> MessageError:
    """Return the error of a message that ends too soon."""
    return MessageError(f"ends after {len(data)} bytes, too soon")


@lru_cache(maxsize=64)
def several(code: str, count: int) -> Struct:
    """Return the struct of `count` numbers of struct code `code`, side by side."""
    return Struct(f"<{count}{code}")


def align(writer: BytesWriter, size: int) -> None:
    """Append padding to the place of a number of `size` bytes, counted from after the header."""
    for _ in range((4 - len(writer)) % size):
        writer.append(0)


class Writer:
    """Appends values to a CDR message."""

    def __init__(self) -> None:
        self._data = BytesWriter()
        self._data.write(HEADER)

    def put(self, code: str, value: object) -> None:
        """Append one number of struct code `code`, aligned."""
        align(self._data, _SIZES[code])
        self._data.write(_ONE[code].pack(value))

    def put_all(self, code: str, *values: object) -> None:
        """Append numbers of one struct code, aligned."""
        align(self._data, _SIZES[code])
        self._data.write(several(code, len(values)).pack(*values))

    def doubles(self, values: tuple[float, ...]) -> None:
        """Append doubles, aligned."""
        align(self._data, 8)
        for value in values:
            write_f64_le(self._data, value)

    def longs(self, values: tuple[int, ...]) -> None:
        """Append unsigned integers of 64 bits, aligned."""
        align(self._data, 8)
        for value in values:
            write_i64_le(self._data, value if value <= MOST_LONG // 2 else value - MOST_LONG - 1)

    def raw(self, data: bytes) -> None:
        """Append what was written at such a `position` before."""
        self._data.write(data)

    @property
    def position(self) -> int:
        """The number of bytes so far, the header's included."""
        return len(self._data)

    def time(self, stamp: int) -> None:
        """Append a builtin_interfaces/Time, from ns."""
        align(self._data, 4)
        write_i32_le(self._data, stamp // SECOND)
        write_i32_le(self._data, stamp % SECOND)

    def text(self, value: str) -> None:
        """Append a string."""
        raw = value.encode()
        align(self._data, 4)
        write_i32_le(self._data, len(raw) + 1)
        self._data.write(raw)
        self._data.append(0)

    def texts(self, values: tuple[str, ...], fields: int = 1) -> None:
        """Append a sequence of strings, or of messages that are so many strings each."""
        self.length(len(values) // fields)
        for value in values:
            self.text(value)

    def numbers(self, code: str, values: tuple[int, ...]) -> None:
        """Append a sequence of numbers."""
        self.length(len(values))
        if values:
            self.put_all(code, *values)

    def length(self, count: int) -> None:
        """Append the length of a sequence."""
        align(self._data, 4)
        write_i32_le(self._data, count)

    def finish(self) -> bytes:
        """Return the message."""
        return self._data.getvalue()


class Reader:
    """Takes values from a CDR message; raises MessageError if it ends too soon or holds nonsense."""

    def __init__(self, data: bytes) -> None:
        if data[:4] != HEADER:
            raise MessageError(f"starts with {data[:4].hex()}, not with the header of little-endian CDR")
        self._data, self._at = data, 4

    @property
    def position(self) -> int:
        """The number of bytes taken so far, the header's included."""
        return self._at

    def take(self, code: str) -> int:
        """Take one integer of struct code `code`."""
        at = self._at + (4 - self._at) % _SIZES[code]
        self._at = at + _SIZES[code]
        try:
            (value,) = _ONE[code].unpack_from(self._data, at)
        except error:
            raise too_short(self._data) from None
        return int(value)

    def take_all(self, code: str, count: int) -> tuple[Any, ...]:
        """Take `count` numbers of struct code `code`."""
        at = self._at + (4 - self._at) % _SIZES[code]
        self._at = at + count * _SIZES[code]
        try:
            return several(code, count).unpack_from(self._data, at)
        except error:
            raise too_short(self._data) from None

    def doubles(self, count: int) -> list[float]:
        """Take `count` doubles."""
        at = self._eights(count)
        return [read_f64_le(self._data, at + 8 * k) for k in range(count)]

    def longs(self, count: int) -> list[int]:
        """Take `count` unsigned integers of 64 bits."""
        at = self._eights(count)
        return [int(read_i64_le(self._data, at + 8 * k)) & MOST_LONG for k in range(count)]

    def _eights(self, count: int) -> int:
        """Take `count` numbers of 8 bytes; return where they begin."""
        at = self._at + (4 - self._at) % 8
        self._at = at + 8 * count
        if self._at > len(self._data):
            raise too_short(self._data)
        return at

    def skips(self, raw: bytes) -> bool:
        """Return whether the bytes `raw` come next; if so, they count as taken."""
        end = self._at + len(raw)
        if self._data[self._at : end] != raw:
            return False
        self._at = end
        return True

    def since(self, begin: int) -> bytes:
        """Return the bytes taken since `position` was `begin`."""
        return self._data[begin : self._at]

    def time(self) -> int:
        """Take a builtin_interfaces/Time, in ns."""
        at = self._at + -self._at % 4
        self._at = at + 8
        if at + 8 > len(self._data):
            raise too_short(self._data)
        seconds: int = read_i32_le(self._data, at)
        rest: int = read_i32_le(self._data, at + 4)
        if not 0 <= rest < SECOND:
            raise MessageError(f"{rest & MOST} ns are more than a second")
        return seconds * SECOND + rest

    def text(self) -> str:
        """Take a string."""
        length = self._unsigned()
        raw = self._data[self._at : self._at + length]
        if len(raw) != length or not raw.endswith(b"\0"):
            raise MessageError(f"a string of {length} bytes does not end where it should")
        self._at += length
        try:
            return raw[:-1].decode()
        except UnicodeDecodeError as wrong:
            raise MessageError(f"a string is not UTF-8: {wrong}") from None

    def texts(self, fields: int = 1) -> tuple[str, ...]:
        """Take a sequence of strings, or of messages that are so many strings each."""
        return tuple([self.text() for _ in range(fields * self.length())])

    def numbers(self, code: str) -> tuple[int, ...]:
        """Take a sequence of integers."""
        count = self.length()
        return self.take_all(code, count) if count else ()

    def length(self) -> int:
        """Take the length of a sequence."""
        count = self._unsigned()
        if count > LONGEST_SEQUENCE:
            raise MessageError(f"a sequence of {count} elements, the most is {LONGEST_SEQUENCE}")
        return count

    def _unsigned(self) -> int:
        """Take a number of 32 bits."""
        at = self._at + -self._at % 4
        self._at = at + 4
        if at + 4 > len(self._data):
            raise too_short(self._data)
        value: int = read_i32_le(self._data, at)
        return value & MOST

    def end(self) -> None:
        """Check that nothing is left but padding to a multiple of 4."""
        left = len(self._data) - self._at
        if left and (left > 3 or any(self._data[self._at :])):
            raise MessageError(f"{left} bytes are left over")
