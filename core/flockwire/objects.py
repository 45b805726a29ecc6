"""Loads objects that a table names as "package.module:name", so that its package does not import them."""

from __future__ import annotations

import importlib
from typing import Any


def load_object(path: str) -> Any:  # noqa: ANN401  (whatever it names)
    """Return the object `package.module:name`; raises ImportError, AttributeError, or errors of the import."""
    module, _, attribute = path.partition(":")
    return getattr(importlib.import_module(module), attribute)
