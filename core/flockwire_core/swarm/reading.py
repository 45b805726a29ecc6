"""Reads TOML files; a bad one is refused with its line and the reason."""

from __future__ import annotations

import errno
import os
import re
import stat
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from flockwire_core.swarm.wording import printable, shown

NO_FILE = "is a pipe or a device, not a file"
NO_TEXT = "is not UTF-8 text"
LARGEST, LARGEST_TOML = 64_000_000, 4_000_000  # bytes
DEEPEST = 16  # tables and lists in each other
TOO_DEEP = f"has more than {DEEPEST} tables or lists in each other"
TOO_LONG = "holds a number of more than 4300 digits"
_DEEP_KEY = re.compile(  # too deep; the parser's time and memory grow with its square
    rf"""(?<![\w\\-])(?:(?:[\w-]++|"(?:[^"\\\n]|\\.)*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+){{{DEEPEST}}}"""
)
CONTROLS = "must not have control characters"
BREAKS = {ord(character): None for character in "\t\n\r"}
_SYNTAX = {  # part of the parser's message; its meaning for the user
    "Invalid value": "a value is a number, true, false, 'text' in quotes, a [list] or a { table }",
    "Expected '=' after": "a key is followed by = and a value",
    "Cannot overwrite": "this key or table has a value already",
    "Cannot declare": "this table appears twice, or is a list",
    "Cannot mutate": "this table is already complete; put the key into it",
    "Unclosed array": "a list ends with ]; its items are separated by commas",
    "Unclosed inline table": "a { table } ends with }; its keys are separated by commas",
    "Expected newline or end": "one key and its value per line; the decimal separator is a point",
    "Unterminated string": "the text lacks its closing quote",
    "Illegal character": "the text lacks its closing quote, or has an invalid character",
    "Expected ']'": "a [table] ends with ] (a [[list of tables]] with ]])",
    "Invalid initial character": "a key is letters, digits, _ and -",
    "Invalid date": "this is not a date; text needs quotes",
}


def stat_file(path: Path) -> os.stat_result:
    """Return the status of a file or folder; raises OSError, also for a pipe or a device, which may never end."""
    found = path.stat()
    if not (stat.S_ISREG(found.st_mode) or stat.S_ISDIR(found.st_mode)):
        raise OSError(errno.EINVAL, NO_FILE, str(path))
    return found


def read_text(path: Path, largest: int = LARGEST) -> str:
    """Return the text of a file, without a byte order mark.

    Raises OSError as `stat_file`, and ValueError: no text, or over `largest` bytes.
    """
    found = stat_file(path)
    if found.st_size > largest:
        raise ValueError(f"has {found.st_size} bytes, must have {largest} or fewer")
    try:
        return path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise ValueError(NO_TEXT) from None


def read_toml(path: Path, what: str, refusal: type[ValueError]) -> dict[str, Any]:
    """Return the content of `path`, called `what`; raises `refusal` if it cannot be read or is not TOML.

    Nor may a text or a key have control characters, which a terminal obeys.
    """
    try:
        text = read_text(path, LARGEST_TOML)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise refusal(f"{path}: cannot read the {what}: {reason}") from error
    if (key := _DEEP_KEY.search(text)) is not None:
        line = 1 + text.count("\n", 0, key.start())
        raise refusal(f"{path}: line {line}: {TOO_DEEP}")
    try:
        table = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        quoted = path.resolve().suffix == ".toml"  # of another file, which may be secret, no line is shown
        raise refusal(f"{path}: {_syntax(str(error), text, quoted)}") from error
    except RecursionError:
        raise refusal(f"{path}: {TOO_DEEP}") from None
    except ValueError:  # Python reads no more digits; no number of a file has as many
        raise refusal(f"{path}: {TOO_LONG}") from None
    if lines := _flaws(table):
        raise refusal("\n".join(f"{path}: {line}" for line in lines))
    return table


def _flaws(table: dict[str, Any]) -> list[str]:
    """Return that `table` is too deep, or a line for each key and text of it with control characters."""
    lines = []
    for key, name, value, depth in _nodes(table):
        if depth == DEEPEST and isinstance(value, dict | list):
            return [TOO_DEEP]
        if not name.isprintable():
            lines.append(f"{key}: {CONTROLS}")
        if isinstance(value, str) and not value.translate(BREAKS).isprintable():
            lines.append(f"{key} = {shown(value)}: {CONTROLS}")
    return lines


def _nodes(value: object, above: str = "", depth: int = 1) -> Iterator[tuple[str, str, object, int]]:
    """Yield the dotted key, name, value and depth of all in a table or list, down to DEEPEST."""
    pairs = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for name, inner in pairs:
        key = printable(f"{above}{name}")
        yield key, str(name), inner, depth
        if depth < DEEPEST:
            yield from _nodes(inner, f"{key}.", depth + 1)


def _syntax(message: str, text: str, quoted: bool) -> str:
    """Return place and problem of a text that is not TOML, its line only if it may be `quoted`."""
    found = re.search(r"\(at line (\d+), column (\d+)\)", message)
    line = int(found[1]) if found else max(1, len(text.rstrip("\n").split("\n")))
    content = [*text.split("\n"), ""][line - 1].strip()
    hint = next((meaning for part, meaning in _SYNTAX.items() if part in message), "this value is not complete")
    column = f", column {found[2]}" if found else ""
    return f"line {line}{column}: not TOML: {f'{shown(content)}: ' if quoted else ''}{hint}"
