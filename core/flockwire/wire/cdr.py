"""CDR of ROS 2: little-endian XCDR1, alignment counted from the end of the 4-byte header.

Source: OMG Common Data Representation (formal/2002-06-51 section 15.3), RTPS 2.3 section 10.2 for the header.
`Writer` and `Reader` serve messages with strings and sequences; those of the 100 Hz path use `layout`, one compiled
struct for a whole message.
"""

from __future__ import annotations

from functools import lru_cache
from struct import Struct, calcsize, error
from typing import Any, Final

from flockwire.domain.time import SECOND

HEADER: Final = b"\x00\x01\x00\x00"  # little-endian CDR
LONGEST_SEQUENCE = 4096
_LENGTH: Final = Struct("<I")
_TIME: Final = Struct("<iI")
_ONE: Final = {code: Struct(f"<{code}") for code in "BHiIQdf"}  # the numbers that messages hold
_SIZES: Final = {code: form.size for code, form in _ONE.items()}
_PADDING: Final = tuple([bytes(count) for count in range(8)])


class MessageError(ValueError):
    """Bytes that are not a message of the expected kind."""


def too_short(data: bytes) -> MessageError:
    """Return the error of a message that ends too soon."""
    return MessageError(f"ends after {len(data)} bytes, too soon")


@lru_cache(maxsize=256)
def layout(frame_length: int, body: str) -> Struct:
    """Return the struct of a message: header, stamp (sec, nanosec), frame id of `frame_length` bytes, then `body`.

    `body` is a string of struct codes; each is aligned to its size, at most 8. The packed values are: HEADER, sec,
    nanosec, frame_length, the frame id with its NUL, and the body's values.
    """
    offset, parts = 12 + frame_length, [f"<4siII{frame_length}s"]
    for code in body:
        size = calcsize(f"<{code}")
        padding = -offset % size
        parts.append(f"{padding}x{code}")
        offset += padding + size
    return Struct("".join(parts))


@lru_cache(maxsize=64)
def several(code: str, count: int) -> Struct:
    """Return the struct of `count` numbers of struct code `code`, side by side."""
    return Struct(f"<{count}{code}")


class Writer:
    """Appends values to a CDR message."""

    def __init__(self) -> None:
        self._data = bytearray(HEADER)

    def put(self, code: str, value: object) -> None:
        """Append one number of struct code `code`, aligned."""
        data = self._data
        data += _PADDING[(4 - len(data)) % _SIZES[code]]
        data += _ONE[code].pack(value)

    def put_all(self, code: str, *values: object) -> None:
        """Append numbers of one struct code, aligned."""
        data = self._data
        data += _PADDING[(4 - len(data)) % _SIZES[code]]
        data += several(code, len(values)).pack(*values)

    def time(self, stamp: int) -> None:
        """Append a builtin_interfaces/Time, from ns."""
        data = self._data
        data += _PADDING[-len(data) % 4]
        data += _TIME.pack(stamp // SECOND, stamp % SECOND)

    def text(self, value: str) -> None:
        """Append a string."""
        data, raw = self._data, value.encode()
        data += _PADDING[-len(data) % 4]
        data += _LENGTH.pack(len(raw) + 1)
        data += raw
        data += _PADDING[1]  # NUL

    def texts(self, values: tuple[str, ...], fields: int = 1) -> None:
        """Append a sequence of strings, or of messages that are so many strings each."""
        self.put("I", len(values) // fields)
        for value in values:
            self.text(value)

    def numbers(self, code: str, values: tuple[int, ...]) -> None:
        """Append a sequence of numbers."""
        self.put("I", len(values))
        if values:
            self.put_all(code, *values)

    def finish(self) -> bytes:
        """Return the message."""
        return bytes(self._data)


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

    def time(self) -> int:
        """Take a builtin_interfaces/Time, in ns."""
        at = self._at + -self._at % 4
        self._at = at + 8
        try:
            sec, nanosec = _TIME.unpack_from(self._data, at)
        except error:
            raise too_short(self._data) from None
        if nanosec >= SECOND:
            raise MessageError(f"{nanosec} ns are more than a second")
        return int(sec * SECOND + nanosec)

    def text(self) -> str:
        """Take a string."""
        length = self.take("I")
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
        count = self.take("I")
        if count > LONGEST_SEQUENCE:
            raise MessageError(f"a sequence of {count} elements, the most is {LONGEST_SEQUENCE}")
        return count

    def end(self) -> None:
        """Check that nothing is left but padding to a multiple of 4."""
        left = len(self._data) - self._at
        if left and (left > 3 or any(self._data[self._at :])):
            raise MessageError(f"{left} bytes are left over")
