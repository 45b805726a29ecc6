"""The fast codec for messages of the 100 Hz path: header, stamp, frame id and numbers as one compiled struct.

pack, length, raw = LAYOUT.heads[frame]
data = pack(HEADER, stamp // SECOND, stamp % SECOND, length, raw, *numbers)
stamp, frame, numbers = unpack(data, LAYOUT)
"""

from __future__ import annotations

from collections.abc import Callable
from math import inf
from struct import Struct, error
from typing import Any, Final

from flockwire.domain.time import SECOND
from flockwire.wire.cdr import HEADER, MessageError, layout

MOST_FRAMES = 64  # frame ids with kept structs: a swarm has one
LONGEST_FRAME = 1 << 16  # bytes, more than any message has
Head = tuple[Callable[..., bytes], int, bytes]  # packs a message; the frame id's length with its NUL; the frame id


class Heads(dict[str, Head]):
    """The heads of messages with the numbers `body` (struct codes), by frame id."""

    def __init__(self, body: str) -> None:
        super().__init__()
        self._body = body

    def __missing__(self, frame: str) -> Head:
        """Return the head for another frame id."""
        if len(self) >= MOST_FRAMES:
            self.clear()
        raw = frame.encode() + b"\0"
        head = self[frame] = (layout(len(raw), self._body).pack, len(raw), raw)
        return head


class Forms(dict[bytes, Struct]):
    """The forms of messages with the numbers `body`, by the frame id's length in the message."""

    def __init__(self, body: str) -> None:
        super().__init__()
        self._body = body

    def __missing__(self, length: bytes) -> Struct:
        """Return the form for another length."""
        if len(self) >= MOST_FRAMES:
            self.clear()
        form = self[length] = layout(min(int.from_bytes(length, "little"), LONGEST_FRAME), self._body)
        return form


class Frames(dict[bytes, str]):
    """Frame ids by their bytes."""

    def __missing__(self, raw: bytes) -> str:
        """Return another frame id; raises MessageError."""
        if not raw.endswith(b"\0"):
            raise MessageError("the frame id does not end with NUL")
        if len(self) >= MOST_FRAMES:
            self.clear()
        try:
            frame = self[raw] = raw[:-1].decode()
        except UnicodeDecodeError:
            raise MessageError("the frame id is not UTF-8") from None
        return frame


class Layout:
    """The layout of a message with the numbers `body` (struct codes)."""

    def __init__(self, body: str) -> None:
        self.heads, self.forms = Heads(body), Forms(body)


_FRAMES: Final = Frames()
_FIRST: Final = Layout("I")


def unpack(data: bytes, expected: Layout) -> tuple[int, str, tuple[Any, ...]]:
    """Return the stamp (Unix ns), the frame and the numbers of a message; raises MessageError.

    Only padding may follow the numbers, and all must be finite.
    """
    form = expected.forms[data[12:16]]
    try:
        found = form.unpack_from(data)
    except error:
        raise _too_short(data) from None
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
        raise _too_short(data) from None


def _too_short(data: bytes) -> MessageError:
    return MessageError(f"ends after {len(data)} bytes, too soon")
