"""The fast codec for messages of the 100 Hz path: header, stamp, frame id and numbers as one compiled struct.

pack, length, raw = LAYOUT.heads[frame]
data = pack(HEADER, stamp // SECOND, stamp % SECOND, length, raw, *numbers)
stamp, frame, numbers = unpack(data, LAYOUT)
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from math import inf
from struct import Struct, error
from typing import Any, Final, TypeVar

from flockwire.domain.time import SECOND
from flockwire.wire.cdr import HEADER, MessageError, layout, too_short

MOST_FRAMES = 64  # frame ids with kept structs: a swarm has one
LONGEST_FRAME = 1 << 16  # bytes, more than any message has
K = TypeVar("K")
V = TypeVar("V")
Head = tuple[Callable[..., bytes], int, bytes]  # packs a message; the frame id's length with its NUL; the frame id


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


class Layout:
    """The layout of a message with the numbers `body` (struct codes): heads by frame id, structs by its length."""

    def __init__(self, body: str) -> None:
        self.heads, self.forms = Kept(partial(_head, body)), Kept(partial(_form, body))


def _head(body: str, frame: str) -> Head:
    raw = frame.encode() + b"\0"
    return layout(len(raw), body).pack, len(raw), raw


def _form(body: str, length: bytes) -> Struct:
    return layout(min(int.from_bytes(length, "little"), LONGEST_FRAME), body)


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
    form = expected.forms[data[12:16]]
    try:
        found = form.unpack_from(data)
    except error:
        raise too_short(data) from None
    seconds: int = found[1]
    rest: int = found[2]
    if rest >= SECOND or found[0] != HEADER:
        raise MessageError("the header is not that of a stamped message in little-endian CDR")
    size = form.size
    if len(data) != size and (len(data) - size > 3 or any(data[size:])):
        raise MessageError(f"{len(data) - size} bytes are left over")
    values = found[5:]
    if not -inf < sum(values) < inf:
        raise MessageError("holds a number that is not finite")
    return seconds * SECOND + rest, _FRAMES[found[4]], values


def peek_length(data: bytes) -> int:
    """Return the length of the first sequence of a stamped message; raises MessageError."""
    try:
        return int(_FIRST.forms[data[12:16]].unpack_from(data)[5])
    except error:
        raise too_short(data) from None
