"""Reads a TOML file; what is wrong with it is told in one line."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any


def read_toml(path: Path, what: str, refusal: type[ValueError]) -> dict[str, Any]:
    """Return the content of `path`, which is called `what`; raises `refusal` where it cannot be read or is no TOML."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "is not UTF-8 text"
        raise refusal(f"{path}: cannot read the {what}: {reason}") from error
    except tomllib.TOMLDecodeError as error:
        raise refusal(f"{path}: not TOML: {error}") from error
