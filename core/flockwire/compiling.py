"""The mark of a class that interpreted code may subclass, also where the class is compiled (hatch_build.py)."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from mypy_extensions import mypyc_attr
else:

    def mypyc_attr(**_: bool) -> Callable[[type], type]:
        """Return the mark, which changes nothing in interpreted code."""
        return lambda marked: marked


__all__ = ("mypyc_attr",)
