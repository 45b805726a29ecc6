"""CDR of ROS 2: little-endian XCDR1, alignment counted from the end of the 4-byte header.

Source: OMG Common Data Representation (formal/2002-06-51 section 15.3), RTPS 2.3 section 10.2 for the header.
Compiled, librt reads and writes numbers without making objects of them.
"""

from __future__ import annotations

from struct import calcsize, pack, unpack_from
from typing import Any, Final

from librt.strings import BytesWriter, read_f64_le, read_i32_le, read_i64_le, write_f64_le, write_i32_le, write_i64_le

from flockwire_core.compiling import mypyc_attr
from flockwire_core.domain.pose import Quaternion
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import Vector

HEADER: Final = b"\x00\x01\x00\x00"  # little-endian CDR
LONGEST_SEQUENCE: Final = 4096
MOST: Final = 0xFFFF_FFFF  # largest number of 32 bits
MOST_LONG: Final = 0xFFFF_FFFF_FFFF_FFFF
_HEADER: Final = int.from_bytes(HEADER, "little")
_SIZES: Final = {code: calcsize(f"<{code}") for code in "BHiIqQdf"}  # of the numbers that messages hold
_PADDING: Final = tuple([bytes(count) for count in range(8)])
# s, Unix: mypyc multiplies numbers from 0 below 2^30 without an object; with one, an interrupt there ends the process.
_RECENT: Final = 1_073_741_824


class MessageError(ValueError):
    """Bytes that are not a message of the expected kind."""


@mypyc_attr(acyclic=True)
class Writer:
    """Appends values to a CDR message."""

    def __init__(self) -> None:
        self._data = BytesWriter()
        write_i32_le(self._data, _HEADER)

    def _align(self, mask: int) -> None:
        """Append padding to a multiple of `mask` + 1 bytes."""
        missing = (4 - len(self._data)) & mask
        if missing:
            self._data.write(_PADDING[missing])

    def byte(self, value: int) -> None:
        """Append a number from 0 to 255."""
        self._data.append(value)

    def unsigned(self, value: int) -> None:
        """Append a number of 32 bits, as the length of a sequence is one."""
        self._align(3)
        write_i32_le(self._data, value if value <= MOST // 2 else value - MOST - 1)

    def long(self, value: int) -> None:
        """Append a number of 64 bits."""
        self._align(7)
        write_i64_le(self._data, value if value <= MOST_LONG // 2 else value - MOST_LONG - 1)

    def double(self, value: float) -> None:
        """Append a double."""
        self._align(7)
        write_f64_le(self._data, value)

    def vector(self, v: Vector) -> None:
        """Append three doubles."""
        self._align(7)
        write_f64_le(self._data, v[0])
        write_f64_le(self._data, v[1])
        write_f64_le(self._data, v[2])

    def quaternion(self, q: Quaternion) -> None:
        """Append four doubles."""
        self.vector((q[0], q[1], q[2]))
        write_f64_le(self._data, q[3])

    def put_all(self, code: str, *values: object) -> None:
        """Append numbers of one struct code, aligned."""
        self._align(_SIZES[code] - 1)
        self._data.write(pack(f"<{len(values)}{code}", *values))

    def time(self, stamp: int) -> None:
        """Append a builtin_interfaces/Time, from ns."""
        self._align(3)
        write_i32_le(self._data, stamp // SECOND)
        write_i32_le(self._data, stamp % SECOND)

    def text(self, value: str) -> None:
        """Append a string."""
        raw = value.encode()
        self.unsigned(len(raw) + 1)
        self._data.write(raw)
        self._data.append(0)

    def octets(self, data: bytes) -> None:
        """Append a sequence of bytes."""
        self.unsigned(len(data))
        self._data.write(data)

    def raw(self, data: bytes) -> None:
        """Append fields that are aligned already."""
        self._data.write(data)

    def texts(self, values: tuple[str, ...], fields: int = 1) -> None:
        """Append a sequence of strings, or of messages that are so many strings each."""
        self.unsigned(len(values) // fields)
        for value in values:
            self.text(value)

    def numbers(self, code: str, values: tuple[float, ...]) -> None:
        """Append a sequence of numbers."""
        self.unsigned(len(values))
        if values:
            self.put_all(code, *values)

    def finish(self) -> bytes:
        """Return the message."""
        return self._data.getvalue()


def begun(stamp: int, frame: str) -> Writer:
    """Return a message that starts with its stamp and its frame."""
    writer = Writer()
    writer.time(stamp)
    writer.text(frame)
    return writer


@mypyc_attr(acyclic=True)
class Reader:
    """Takes values from a CDR message; raises MessageError if it ends too soon or holds nonsense."""

    def __init__(self, data: bytes) -> None:
        if len(data) < 4 or read_i32_le(data, 0) != _HEADER:
            raise MessageError(f"starts with {data[:4].hex()}, not with the header of little-endian CDR")
        self._data, self._at = data, 4

    @property
    def left(self) -> int:
        """The number of bytes not taken yet."""
        return len(self._data) - self._at

    def _take(self, mask: int, size: int) -> int:
        """Take `size` bytes at a multiple of `mask` + 1 bytes; return where they begin."""
        at = self._at + ((4 - self._at) & mask)
        if at + size > len(self._data):
            raise MessageError(f"ends after {len(self._data)} bytes, too soon")
        self._at = at + size
        return at

    def byte(self) -> int:
        """Take a number from 0 to 255."""
        return self._data[self._take(0, 1)]

    def unsigned(self) -> int:
        """Take a number of 32 bits."""
        value: int = read_i32_le(self._data, self._take(3, 4))
        return value & MOST

    def long(self) -> int:
        """Take a number of 64 bits."""
        value: int = read_i64_le(self._data, self._take(7, 8))
        return value if value >= 0 else value + MOST_LONG + 1

    def double(self) -> float:
        """Take a finite double."""
        value: float = read_f64_le(self._data, self._take(7, 8))
        if value - value != 0.0:  # infinite or not a number; cheaper, compiled, than a function of `math`
            raise MessageError("holds a number that is not finite")
        return value

    def vector(self) -> Vector:
        """Take three finite doubles."""
        at, data = self._take(7, 24), self._data
        x: float = read_f64_le(data, at)
        y: float = read_f64_le(data, at + 8)
        z: float = read_f64_le(data, at + 16)
        total = x + y + z
        if total - total != 0.0:
            raise MessageError("holds a number that is not finite")
        return (x, y, z)

    def quaternion(self) -> Quaternion:
        """Take four finite doubles."""
        x, y, z = self.vector()
        return (x, y, z, self.double())

    def take(self, code: str) -> int:
        """Take one integer of struct code `code`."""
        return int(self.take_all(code, 1)[0])

    def take_all(self, code: str, count: int) -> tuple[Any, ...]:
        """Take `count` numbers of struct code `code`."""
        size = _SIZES[code]
        return unpack_from(f"<{count}{code}", self._data, self._take(size - 1, count * size))

    def time(self) -> int:
        """Take a builtin_interfaces/Time, in ns."""
        at = self._take(3, 8)
        seconds: int = read_i32_le(self._data, at)
        rest: int = read_i32_le(self._data, at + 4)
        if not 0 <= rest < SECOND:
            raise MessageError(f"{rest & MOST} ns are more than a second")
        if seconds < _RECENT:
            return seconds * SECOND + rest
        return (seconds - _RECENT) * SECOND + _RECENT * SECOND + rest

    def text(self) -> str:
        """Take a string."""
        size = self.unsigned()
        at = self._take(0, size)
        if not size or self._data[at + size - 1]:
            raise MessageError(f"a string of {size} bytes does not end with NUL")
        try:
            return self._data[at : at + size - 1].decode()
        except UnicodeDecodeError as wrong:
            raise MessageError(f"a string is not UTF-8: {wrong}") from None

    def octets(self) -> bytes:
        """Take a sequence of bytes."""
        return self.raw(self.unsigned())

    def raw(self, size: int) -> bytes:
        """Take `size` bytes."""
        at = self._take(0, size)
        return self._data[at : at + size]

    def numbers(self, code: str) -> tuple[int, ...]:
        """Take a sequence of integers."""
        count = self.length()
        return self.take_all(code, count) if count else ()

    def length(self) -> int:
        """Take the length of a sequence."""
        count = self.unsigned()
        if count > LONGEST_SEQUENCE:
            raise MessageError(f"a sequence of {count} elements, the most is {LONGEST_SEQUENCE}")
        return count

    def end(self) -> None:
        """Check that nothing is left but padding to a multiple of 4."""
        left = len(self._data) - self._at
        if left and (left > 3 or any(self._data[self._at :])):
            raise MessageError(f"{left} bytes are left over")
