"""The form of a law's own message: its octets and its ROS 2 definition follow from the named tuple."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from math import isfinite
from operator import index
from struct import Struct, error
from typing import Any, Final, SupportsIndex, cast, get_args, get_origin, get_type_hints

from flockwire_core.domain.law_message import LawMessage
from flockwire_core.domain.motion import LeaderMotion
from flockwire_core.law import Information, is_number
from flockwire_core.wire.cdr import MessageError, Reader, Writer

UNDECLARED: Final = "the law returned a message, but its information declares none"
LARGEST: Final = 8192  # bytes of one message
VALID_AT: Final = "valid_at"  # the field that a trace adds to those of a message
FIXED: Final = "must be float, int or a fixed tuple of them, as tuple[float, float, float]"


class FormError(ValueError):
    """A type that cannot be a law's message."""


class LawForm:
    """The form of `kind`, a NamedTuple of floats, ints and fixed tuples of them; raises FormError for another type."""

    def __init__(self, kind: type) -> None:
        if not (isinstance(kind, type) and issubclass(kind, tuple) and hasattr(kind, "_fields")):
            raise FormError(f"message {getattr(kind, '__name__', kind)!r} must be a NamedTuple")
        self._kind, hints = kind, get_type_hints(kind)
        self._fields = {name: hints[name] for name in cast("Any", kind)._fields}
        if len({VALID_AT, *map(str.lower, self._fields)}) <= len(self._fields):
            raise FormError(f"message {kind.__name__}: its fields must differ in lower case, and none be {VALID_AT!r}")
        codes = {name: "".join(_codes(one, f"{kind.__name__}.{name}")) for name, one in self._fields.items()}
        self._struct = Struct("<" + "".join(codes.values()))
        self.size = self._struct.size  # bytes
        self.count = self.size // 8  # numbers
        self.definition = "".join([f"\n{line}" for name, code in codes.items() for line in _lines(name, code)])

    def pack(self, message: object) -> bytes:
        """Return the octets of a message; raises ValueError or TypeError for one of another form."""
        if not isinstance(message, self._kind):
            raise TypeError(f"a message must be a {self._kind.__name__}, not {message!r}")
        try:
            return self._struct.pack(*self.flat(message))
        except error as wrong:
            raise ValueError(f"{message!r}: {wrong}") from None

    def flat(self, message: Iterable[object]) -> list[float]:
        """Return the numbers of a message, one after the other."""
        return [
            value
            for (name, kind), part in zip(self._fields.items(), message, strict=True)
            for value in _flat(kind, part, name)
        ]

    def unpack(self, data: bytes) -> object:
        """Return the message of some octets; raises MessageError."""
        if len(data) != self.size:
            raise MessageError(f"a law's message of {len(data)} bytes, not {self.size}")
        values = self._struct.unpack(data)
        if not all(map(isfinite, values)):
            raise MessageError("holds a number that is not finite")
        numbers = iter(values)
        return self._kind(*[_built(kind, numbers) for kind in self._fields.values()])


def law_form(information: Information) -> LawForm | None:
    """Return the form of a law's own messages; None for a law without, or that relays estimates; raises FormError."""
    if information.message is None or information.message is LeaderMotion:
        return None
    form = LawForm(information.message)
    if form.size > LARGEST:
        name = information.message.__name__
        raise FormError(f"message {name} takes {form.size} bytes, at most {LARGEST} may be sent")
    return form


def packed(message: object, declared: Information, form: LawForm | None) -> bytes | None:
    """Return the octets of a law's message, None without; raises ValueError or TypeError for one it may not send."""
    if message is None:
        return None
    if form is not None:
        return form.pack(message)
    if declared.message is None:
        raise ValueError(f"{UNDECLARED}: {message!r}")
    if not isinstance(message, LeaderMotion):
        raise TypeError(f"a message must be a LeaderMotion, not {message!r}")
    return None  # an estimate has its own key


def write_law_message(writer: Writer, message: LawMessage) -> None:
    """Append a law's message."""
    writer.long(message.epoch)
    writer.long(message.sequence)
    writer.unsigned(len(message.contents))
    for stamp, data in message.contents:
        writer.long(stamp)
        writer.raw(data)


def read_law_message(stamp: int, frame: str, reader: Reader) -> LawMessage:
    """Take a law's message, whatever its law; raises MessageError."""
    epoch, sequence, count = reader.long(), reader.long(), reader.length()
    if not count:
        return LawMessage(stamp, frame, epoch, sequence, ())
    first = reader.long()
    size, rest = divmod(reader.left - 8 * (count - 1), count)
    if count > sequence or size < 0 or rest:
        raise MessageError(f"{count} contents of one size, up to number {sequence}, in {reader.left} bytes")
    contents = [(first, reader.raw(size))]
    contents += [(reader.long(), reader.raw(size)) for _ in range(count - 1)]
    return LawMessage(stamp, frame, epoch, sequence, tuple(contents))


def _codes(kind: Any, name: str) -> Iterator[str]:  # noqa: ANN401
    """Yield the struct codes of a field's type."""
    if kind is float or kind is int:
        yield "d" if kind is float else "q"
    elif get_origin(kind) is tuple and get_args(kind) and Ellipsis not in get_args(kind):
        for part in get_args(kind):
            yield from _codes(part, name)
    else:
        raise FormError(f"message field {name}: {getattr(kind, '__name__', kind)!s} has no fixed size, {FIXED}")


def _lines(name: str, code: str) -> Iterator[str]:
    """Yield the ROS 2 definition of a field; one that mixes both types has a line for each number."""
    types = {"d": "float64", "q": "int64"}
    if len(code) == 1:
        yield f"{types[code]} {name.lower()}"
    elif len(set(code)) == 1:
        yield f"{types[code[0]]}[{len(code)}] {name.lower()}"
    else:
        yield from (f"{types[one]} {name.lower()}_{place}" for place, one in enumerate(code))


def _flat(kind: Any, value: Any, name: str) -> Iterator[float]:  # noqa: ANN401
    """Yield the numbers of a field."""
    if kind is float:
        if not is_number(value):
            raise ValueError(f"message field {name} = {value!r}: must be a finite number")
        yield float(value)
    elif kind is int:
        if not isinstance(value, SupportsIndex):
            raise ValueError(f"message field {name} = {value!r}: must be a whole number")
        yield index(value)
    else:
        parts = get_args(kind)
        if len(value) != len(parts):
            raise ValueError(f"message field {name} has {len(value)} parts, not {len(parts)}")
        for part, one in zip(parts, value, strict=True):
            yield from _flat(part, one, name)


def _built(kind: Any, numbers: Iterator[float]) -> Any:  # noqa: ANN401
    return next(numbers) if kind in (float, int) else tuple([_built(part, numbers) for part in get_args(kind)])
