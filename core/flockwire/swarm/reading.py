"""Reads TOML files; what is wrong with one becomes lines of key, value and rule."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

from pydantic import ValidationError


def read_toml(path: Path, what: str, refusal: type[ValueError]) -> dict[str, Any]:
    """Return the content of `path`, which is called `what`; raises `refusal` where it cannot be read or is no TOML."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "is not UTF-8 text"
        raise refusal(f"{path}: cannot read the {what}: {reason}") from error
    except tomllib.TOMLDecodeError as error:
        raise refusal(f"{path}: not TOML: {error}") from error


def error_lines(error: ValidationError) -> list[str]:
    """Return what a model found wrong as lines of key, value and rule."""
    return [line for detail in error.errors() for line in _lines(dict(detail))]


def _is_kind(path: tuple[object, ...]) -> bool:
    """Return whether pydantic puts a table's kind behind `path`, which is no key of the file."""
    return path in (("formation",), ("leader", "trajectory")) or (len(path) == 2 and path[0] == "formations")


def _lines(detail: dict[str, object]) -> list[str]:
    """Turn one of pydantic's errors into lines of key, value and rule."""
    location = detail["loc"]
    assert isinstance(location, tuple)  # noqa: S101  (pydantic says so)
    message = str(detail["msg"]).removeprefix("Value error, ")
    if not location:
        return message.split("\n")
    key = ".".join(str(part) for place, part in enumerate(location) if not _is_kind(location[:place]))
    if detail["type"] == "missing":
        return [f"{key}: missing; this key has no default"]
    if detail["type"] == "extra_forbidden":
        return [f"{key} = {detail['input']!r}: unknown key"]
    return [f"{key} = {detail['input']!r}: {message[0].lower()}{message[1:]}"]
