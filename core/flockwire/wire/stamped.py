"""The fast codec for messages of the 100 Hz path: header, stamp, frame id and numbers as one compiled struct.

head = LAYOUT.heads[frame]
data = head.pack(HEADER, stamp // SECOND, stamp % SECOND, head.length, head.raw, *numbers)
stamp, frame, numbers = unpack(data, LAYOUT)
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from math import isinf, isnan
from struct import Struct, error
from typing import Any, Final, TypeVar

from flockwire.domain.time import SECOND
from flockwire.wire.cdr import HEADER, MessageError, layout, too_short

MOST_FRAMES = 64  # frame ids with kept structs: a swarm has one
LONGEST_FRAME = 1 << 16  # bytes, more than any message has
K = TypeVar("K")
V = TypeVar("V")


class Kept(dict[K, V]):
    """What `make` returns, by its argument; all are forgotten where there would be more than `most`."""

    def __init__(self, make: Callable[[K], V], most: int = MOST_FRAMES) -> None:
        super().__init__()
        self._make, self._most = make, most

    def __missing__(self, key: K) -> V:
        """Return the value for another key."""
        if len(self) >= self._most:
            self.clear()
        value = self[key] = self._make(key)
        return value


class Head:
    """What messages with the frame id `raw` (with its NUL) have in common."""

    def __init__(self, struct: Struct, raw: bytes) -> None:
        self.pack: Callable[..., bytes] = struct.pack
        self.length: object = len(raw)  # an object, as it goes into `pack`
        self.raw = raw


class Form:
    """The form of messages with one length of the frame id, and what the last of them had: the next ones have it too.

    Two threads may read messages: each of these attributes changes at once.
    """

    def __init__(self, struct: Struct, length: bytes) -> None:
        self.size, self.length = struct.size, length  # bytes; of the frame id, as in the message
        self.unpack: Callable[[bytes], tuple[Any, ...]] = struct.unpack_from
        self.named: tuple[bytes | None, str] = (None, "")  # the frame id
        self.second: tuple[int, int] = (0, 0)  # the stamp's whole second: its number, its ns


class Layout:
    """The layout of a message with the numbers `body` (struct codes): heads by frame id, forms by its length."""

    def __init__(self, body: str) -> None:
        self.heads, self.forms = Kept(partial(_head, body)), Kept(partial(_form, body))
        self.last = self.forms[b"\0\0\0\0"]  # the form of the last message


def _head(body: str, frame: str) -> Head:
    raw = frame.encode() + b"\0"
    return Head(layout(len(raw), body), raw)


def _form(body: str, length: bytes) -> Form:
    return Form(layout(min(int.from_bytes(length, "little"), LONGEST_FRAME), body), length)


def _frame(raw: bytes) -> str:
    """Return a frame id; raises MessageError."""
    if not raw.endswith(b"\0"):
        raise MessageError("the frame id does not end with NUL")
    try:
        return raw[:-1].decode()
    except UnicodeDecodeError:
        raise MessageError("the frame id is not UTF-8") from None


_FRAMES: Final = Kept(_frame)
_FIRST: Final = Layout("I")


def unpack(data: bytes, expected: Layout) -> tuple[int, str, tuple[Any, ...]]:
    """Return the stamp (Unix ns), the frame and the numbers of a message; raises MessageError.

    Only padding may follow the numbers, and all must be finite.
    """
    form, length = expected.last, data[12:16]
    if length != form.length:
        form = expected.last = expected.forms[length]
    try:
        found = form.unpack(data)
    except error:
        raise too_short(data) from None
    rest: int = found[2]
    if rest >= SECOND or found[0] != HEADER:
        raise MessageError("the header is not that of a stamped message in little-endian CDR")
    size = form.size
    if len(data) != size and (len(data) - size > 3 or any(data[size:])):
        raise MessageError(f"{len(data) - size} bytes are left over")
    values = found[5:]
    total: float = sum(values)
    if isinf(total) or isnan(total):
        raise MessageError("holds a number that is not finite")
    second, named = form.second, form.named
    if found[1] != second[0]:
        second = form.second = (found[1], found[1] * SECOND)
    if found[4] != named[0]:
        named = form.named = (found[4], _FRAMES[found[4]])
    return second[1] + rest, named[1], values


def peek_length(data: bytes) -> int:
    """Return the length of the first sequence of a stamped message; raises MessageError."""
    try:
        return int(_FIRST.forms[data[12:16]].unpack(data)[5])
    except error:
        raise too_short(data) from None
