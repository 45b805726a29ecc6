"""What the messages of the 100 Hz path have in common: header, stamp, frame id; then numbers at known places.

Compiled, librt.strings reads and writes each number where it stands, and no object is made of it.
"""

from __future__ import annotations

from typing import Final

from librt.strings import BytesWriter, read_f64_le, read_i32_le, write_f64_le, write_i32_le

from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import Vector
from flockwire_core.wire.cdr import HEADER, MessageError, too_short

RECENT: Final = 1_500_000_000  # s, Unix: what mypyc multiplies without an object is below 2^30
_HEADER: Final = int.from_bytes(HEADER, "little")
_SIZES: Final = 16  # bytes up to the frame id: header, stamp, its length


class _Named:
    """The frame id of the last message that was read, and of those that were written: the next one has the same.

    Each changes at once: two threads may read messages.
    """

    def __init__(self) -> None:
        self.frame: tuple[bytes, str] = (b"\0", "")
        self.wide: tuple[str, bytes] = ("", b"")  # frame id, and head of a message without header and stamp
        self.narrow: tuple[str, bytes] = ("", b"")  # the same, padded for numbers of 4 bytes


_LAST: Final = _Named()


def begin(stamp: int, frame: str, alignment: int = 8) -> BytesWriter:
    """Return a message with header, `stamp` (Unix ns) and frame id, padded for numbers of `alignment` bytes, 4 or 8."""
    named = _LAST.wide if alignment == 8 else _LAST.narrow
    head = named[1] if named[1] and named[0] == frame else _head(frame, alignment)
    writer = BytesWriter()
    writer.write(HEADER)
    write_i32_le(writer, stamp // SECOND)
    write_i32_le(writer, stamp % SECOND)
    writer.write(head)
    return writer


def _head(frame: str, alignment: int) -> bytes:
    raw = frame.encode() + b"\0"
    head = len(raw).to_bytes(4, "little") + raw + bytes(-(_SIZES - 4 + len(raw)) % alignment)
    if alignment == 8:
        _LAST.wide = frame, head
    else:
        _LAST.narrow = frame, head
    return head


def write_vector(writer: BytesWriter, v: Vector) -> None:
    """Append the three numbers of `v`."""
    write_f64_le(writer, v[0])
    write_f64_le(writer, v[1])
    write_f64_le(writer, v[2])


def read_head(data: bytes) -> tuple[int, str, int]:
    """Return stamp (Unix ns), frame id, and where that ends, a multiple of 4; raises MessageError."""
    if len(data) < _SIZES:
        raise too_short(data)
    seconds: int = read_i32_le(data, 4)
    rest: int = read_i32_le(data, 8)
    length: int = read_i32_le(data, 12)
    if not 0 <= rest < SECOND or read_i32_le(data, 0) != _HEADER:
        raise MessageError("the header is not that of a stamped message in little-endian CDR")
    end = _SIZES + length
    if length < 0 or end > len(data):
        raise too_short(data)
    raw, named = data[_SIZES:end], _LAST.frame
    stamp = (seconds - RECENT) * SECOND + RECENT * SECOND + rest
    return stamp, named[1] if raw == named[0] else _frame(raw), end + -end % 4


def _frame(raw: bytes) -> str:
    """Return a frame id; raises MessageError."""
    if not raw.endswith(b"\0"):
        raise MessageError("the frame id does not end with NUL")
    try:
        frame = raw[:-1].decode()
    except UnicodeDecodeError:
        raise MessageError("the frame id is not UTF-8") from None
    _LAST.frame = raw, frame
    return frame


def last_numbers(data: bytes, at: int, size: int) -> int:
    """Return the place of the first double from `at` on; `size` bytes of numbers begin there, and end the message.

    Raises MessageError if they do not.
    """
    at += (4 - at) % 8
    if len(data) != at + size:
        check_end(data, at + size)
    return at


def check_end(data: bytes, end: int) -> None:
    """Raise MessageError unless the message's content ends at `end`: only padding may follow."""
    left = len(data) - end
    if left < 0:
        raise too_short(data)
    if left and (left > 3 or any(data[end:])):
        raise MessageError(f"{left} bytes are left over")


def read_vector(data: bytes, at: int) -> Vector:
    """Return the three numbers at `at`."""
    return (read_f64_le(data, at), read_f64_le(data, at + 8), read_f64_le(data, at + 16))


def check_finite(total: float) -> None:
    """Raise MessageError unless the sum of a message's numbers is finite."""
    if total - total != 0.0:  # infinite or not a number; cheaper, compiled, than a function of `math`
        raise MessageError("holds a number that is not finite")
