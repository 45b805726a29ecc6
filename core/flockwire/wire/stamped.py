"""The fast codec for messages of the 100 Hz path: header, stamp, frame id and numbers as one compiled struct."""

from __future__ import annotations

from functools import lru_cache
from math import isfinite
from struct import Struct, error

from flockwire.domain.time import SECOND
from flockwire.wire.cdr import HEADER, MessageError, layout


def pack(stamp: int, frame: str, body: str, *values: object) -> bytes:
    """Return the CDR bytes of a message stamped `stamp` (Unix ns) in `frame`, with `values` of struct codes `body`."""
    form, length, raw = _form(frame, body)
    return form.pack(HEADER, stamp // SECOND, stamp % SECOND, length, raw, *values)


def unpack(data: bytes, body: str) -> tuple[int, str, tuple[float, ...]]:
    """Return the stamp, the frame and the values of what `pack` made; raises MessageError.

    Nothing but padding may follow the values, and all must be finite.
    """
    form = _fitting(data[12:16], len(data), body)
    try:
        found = form.unpack_from(data)
    except error:
        raise _too_short(data) from None
    nanosec, values = found[2], found[5:]
    if found[0] != HEADER or nanosec >= SECOND:
        raise MessageError("the header is not that of a stamped message in little-endian CDR")
    if len(data) != form.size and (len(data) - form.size > 3 or any(data[form.size :])):
        raise MessageError(f"{len(data) - form.size} bytes are left over")
    if not isfinite(sum(values)):
        raise MessageError("holds a number that is not finite")
    return found[1] * SECOND + nanosec, _text(found[4]), values


def peek_length(data: bytes) -> int:
    """Return the length of the sequence that a stamped message begins with; raises MessageError."""
    try:
        return int(_fitting(data[12:16], len(data), "I").unpack_from(data)[5])
    except error:
        raise _too_short(data) from None


@lru_cache(maxsize=256)
def _fitting(length: bytes, size: int, body: str) -> Struct:
    """Return the struct of a message of `size` bytes, for the frame id's `length` that stands in it."""
    return layout(min(int.from_bytes(length, "little"), size), body)


def _too_short(data: bytes) -> MessageError:
    return MessageError(f"ends after {len(data)} bytes, too soon")


@lru_cache(maxsize=256)
def _form(frame: str, body: str) -> tuple[Struct, int, bytes]:
    raw = frame.encode() + b"\0"
    return layout(len(raw), body), len(raw), raw


@lru_cache(maxsize=64)
def _text(raw: bytes) -> str:
    if not raw.endswith(b"\0"):
        raise MessageError("the frame id does not end with NUL")
    try:
        return raw[:-1].decode()
    except UnicodeDecodeError:
        raise MessageError("the frame id is not UTF-8") from None
