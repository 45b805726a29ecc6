"""Objects that a table names as "package.module:name": the table's own package does not import them."""

from __future__ import annotations

import importlib
from typing import Any


def load_object(path: str) -> Any:  # noqa: ANN401  (whatever it names)
    """Return what `package.module:name` names; raises ImportError, AttributeError, or what the import raises."""
    module, _, attribute = path.partition(":")
    return getattr(importlib.import_module(module), attribute)
