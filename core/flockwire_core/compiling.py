"""The mark of a class that is compiled in another way than others (hatch_build.py): mypyc's documentation has them."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from mypy_extensions import mypyc_attr
else:

    def mypyc_attr(**_: int) -> Callable[[type], type]:
        """Return the mark, which changes nothing in interpreted code."""
        return lambda marked: marked


__all__ = ("mypyc_attr",)
