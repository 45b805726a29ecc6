"""Packages that only some sources need: a missing one is named with the command that installs it."""

from __future__ import annotations

import importlib
from typing import Any

from flockwire.extras import remedy


class MissingExtraError(OSError):
    """A package that the source needs is not installed; the text says how to install it."""


def imported(module: str, extra: str) -> Any:  # noqa: ANN401  (any module)
    """Return the module of that name; raises MissingExtraError with the extra of flockwire that brings it."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        line = f"gateway.source = {extra!r} needs the package {module.replace('_', '-')}"
        raise MissingExtraError(f"{line}: {remedy(extra)} ({error})") from None
