"""Records, the immutable values of the 100 Hz path, and the base of frozen dataclasses that are compiled.

A named tuple holds objects, also of each float, and is asked for them by name. A record's fields are declared in its
constructor: compiled (hatch_build.py) it is one C structure, in which a vector is three doubles.
"""

from __future__ import annotations

from dataclasses import fields
from typing import Any, ClassVar, Self

from flockwire_core.compiling import mypyc_attr


@mypyc_attr(acyclic=True)
class Record:
    """Base of all records; `__slots__` names the fields, in the order of the constructor's arguments.

    Records are equal if their fields are. They cannot be unpacked or compared by order.
    """

    __slots__: ClassVar[tuple[str, ...]] = ()

    def fields(self) -> tuple[Any, ...]:
        """Return the fields."""
        return tuple([getattr(self, name) for name in self.__slots__])

    def _replace(self, **changes: object) -> Self:
        """Return a copy with some fields changed."""
        return type(self)(**{name: getattr(self, name) for name in self.__slots__} | changes)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Record) and type(self) is type(other) and self.fields() == other.fields()

    def __hash__(self) -> int:
        return hash(self.fields())

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join([f'{name}={getattr(self, name)!r}' for name in self.__slots__])})"

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), self.fields()


class Frozen:
    """Copies and pickles by the constructor: a compiled frozen dataclass cannot be filled in afterwards."""

    __slots__: ClassVar[tuple[str, ...]] = ()

    def __reduce__(self) -> tuple[Any, ...]:
        given = [field.name for field in fields(self) if field.init]  # type: ignore[arg-type]
        return type(self), tuple([getattr(self, name) for name in given])
