"""The base of frozen dataclasses that are compiled (hatch_build.py)."""

from __future__ import annotations

from dataclasses import fields
from typing import Any, ClassVar


class Frozen:
    """Copies and pickles by the constructor: a compiled frozen dataclass cannot be filled in afterwards."""

    __slots__: ClassVar[tuple[str, ...]] = ()

    def __reduce__(self) -> tuple[Any, ...]:
        given = [field.name for field in fields(self) if field.init]  # type: ignore[arg-type]
        return type(self), tuple([getattr(self, name) for name in given])
