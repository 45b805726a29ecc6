"""Reads TOML files; problems become lines of key, value and rule.

pydantic's texts name branches of unions and Python types, and suggest no key: they are not used.
"""

from __future__ import annotations

import errno
import re
import stat
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Literal, NamedTuple, get_args, get_origin

from pydantic import BaseModel, ValidationError

from flockwire_core.swarm.outline import Place, entries, explanation, is_model, kinds, place
from flockwire_core.swarm.wording import meant, one_of, printable, shown, takes

NO_FILE = "is a pipe or a device, not a file"
NO_TEXT = "is not UTF-8 text"
LARGEST, LARGEST_TOML = 64_000_000, 4_000_000  # bytes
DEEPEST = 16  # tables and lists in each other
TOO_DEEP = f"has more than {DEEPEST} tables or lists in each other"
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


class Fault(NamedTuple):
    """One problem: its line, and the keys that no other rule may use."""

    line: str
    taints: tuple[str, ...]


def read_text(path: Path, largest: int = LARGEST) -> str:
    """Return the text of a file, without a byte order mark.

    Raises OSError, also for a pipe or a device, which may never end, and ValueError: no text, or over `largest` bytes.
    """
    found = path.stat()
    if not (stat.S_ISREG(found.st_mode) or stat.S_ISDIR(found.st_mode)):
        raise OSError(errno.EINVAL, NO_FILE)
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
    try:
        table = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        quoted = path.resolve().suffix == ".toml"  # of another file, which may be secret, no line is shown
        raise refusal(f"{path}: {_syntax(str(error), text, quoted)}") from error
    except RecursionError:
        raise refusal(f"{path}: {TOO_DEEP}") from None
    except ValueError as error:  # a number of more digits than Python reads
        raise refusal(f"{path}: not TOML: {error}") from None
    if _depth(table) > DEEPEST:
        raise refusal(f"{path}: {TOO_DEEP}")
    if lines := [f"{path}: {wrong}: {CONTROLS}" for wrong in _with_controls(table)]:
        raise refusal("\n".join(lines))
    return table


def _depth(table: dict[str, Any]) -> int:
    """Return how many tables and lists lie in each other, up to one more than DEEPEST."""
    depth, level = 0, [table.values()]
    while level and depth <= DEEPEST:
        depth += 1
        inner = [one for values in level for one in values if isinstance(one, dict | list)]
        level = [one.values() if isinstance(one, dict) else one for one in inner]  # type: ignore[misc]
    return depth


def _with_controls(table: dict[str, Any]) -> Iterator[str]:
    """Yield keys of `table` that have control characters, or texts with them, but for tabs and line breaks."""
    rest: list[tuple[str, Any]] = [("", table)]
    while rest:
        prefix, value = rest.pop()
        inner = value.items() if isinstance(value, dict) else enumerate(value)
        for key, one in inner:
            where = printable(f"{prefix}{key}")
            if not str(key).isprintable():
                yield where
            if isinstance(one, str) and not one.translate(BREAKS).isprintable():
                yield f"{where} = {shown(one)}"
            elif isinstance(one, dict | list):
                rest.append((f"{where}.", one))


def _syntax(message: str, text: str, quoted: bool) -> str:
    """Return place and problem of a text that is not TOML, its line only if it may be `quoted`."""
    found = re.search(r"\(at line (\d+), column (\d+)\)", message)
    line = int(found[1]) if found else max(1, len(text.rstrip("\n").split("\n")))
    content = [*text.split("\n"), ""][line - 1].strip()
    hint = next((meaning for part, meaning in _SYNTAX.items() if part in message), "this value is not complete")
    column = f", column {found[2]}" if found else ""
    return f"line {line}{column}: not TOML: {f'{shown(content)}: ' if quoted else ''}{hint}"


def error_lines(error: ValidationError, model: type[BaseModel]) -> list[str]:
    """Return the errors of `model` as lines of key, value and rule."""
    return list(dict.fromkeys(fault.line for fault in faults(error, model)))


def faults(error: ValidationError, model: type[BaseModel]) -> Iterator[Fault]:
    """Yield the errors of `model`, in the order of its keys."""
    for detail in error.errors():
        location = detail["loc"]
        where = place(model, location)
        if detail["type"] == "extra_forbidden":
            yield _unknown(model, where, location, detail["input"])
            continue
        for line in _lines(model, where, dict(detail)):
            yield Fault(line, (untold(where),) if location else ("",))


def untold(where: Place) -> str:
    """Return a dotted key without its list positions."""
    return ".".join(str(key) for key in where.keys if not isinstance(key, int))


def _lines(model: type[BaseModel], where: Place, detail: dict[str, Any]) -> list[str]:
    """Convert one error to lines of key, value and rule."""
    key, kind, value = where.text, detail["type"], detail["input"]
    if kind == "value_error" and not where.keys:
        return str(detail["ctx"]["error"]).split("\n")
    if kind == "value_error":
        return [f"{key} = {shown(value)}: {detail['ctx']['error']}"]
    if kind in ("union_tag_invalid", "union_tag_not_found"):
        told = "missing;" if kind == "union_tag_not_found" else f"= {shown(value.get('kind'))}:"
        near = "" if kind == "union_tag_not_found" else meant(value.get("kind"), kinds(where.kind))
        return [f"{key}.kind {told} must be {one_of(kinds(where.kind))}{near}".replace(" missing", ": missing")]
    if kind in ("missing", "too_long") and where.keys and isinstance(where.keys[-1], int):
        where = place(model, detail["loc"][:-1])  # a list that is too short lacks an item
        return [f"{where.text} = {shown(value)}: must be {takes(where.kind, where.metadata)}"]
    told = takes(where.kind, where.metadata)
    if kind in ("less_than", "less_than_equal"):
        told += _unit(model, detail["loc"])
    if kind == "missing":
        return [f"{key}: missing; this key has no default" + (f" and must be {told}" if told else "")]
    near = meant(value, map(str, get_args(where.kind))) if get_origin(where.kind) is Literal else ""
    return [f"{key} = {shown(value)}: " + (f"must be {told}{near}" if told else "this is not allowed here")]


def _unit(model: type[BaseModel], location: tuple[str | int, ...]) -> str:
    """Return the unit of a number that is too large, to follow its bounds: it may have been given in another one."""
    table = place(model, location[:-1]).kind if len(location) > 1 else model
    unit = explanation(table, str(location[-1]))[0] if is_model(table) else ""
    return f", in {unit}" if unit else ""


def _unknown(model: type[BaseModel], where: Place, location: tuple[str | int, ...], value: object) -> Fault:
    """Refuse an unknown key, and suggest the nearest known one by spelling or in another table."""
    *path, name = where.keys
    from difflib import get_close_matches  # noqa: PLC0415  (a file without mistakes needs none)

    table = place(model, location[:-1])
    siblings = _names(table.kind)
    above = ".".join(map(str, path))
    close = get_close_matches(str(name), siblings, n=1) or [one for one in siblings if str(name) in one.split("_")]
    near = [f"{above}.{one}" if above else one for one in close]
    if not near:
        near = _elsewhere(model, table, str(name))
    hint = f"did you mean {' or '.join(near)}?" if near else f"known here: {', '.join(siblings) or 'none'}"
    meant = ".".join(part for part in near[0].split(".") if not part.isdigit()) if near else untold(where)
    return Fault(f"{where.text} = {shown(value)}: unknown key; {hint}", (meant,))


def _names(kind: object) -> list[str]:
    """Return the keys of a table."""
    if not is_model(kind):
        return []
    return [entry.name for entry in entries(kind) if not entry.table]  # type: ignore[arg-type]


def _elsewhere(model: type[BaseModel], table: Place, name: str) -> list[str]:
    """Return up to two keys of the whole file with this name, first from another kind of the same table."""
    every = list(entries(model))
    here = ".".join("N" if isinstance(key, int) else str(key) for key in table.keys)
    found = sorted((entry for entry in every if entry.name == name), key=lambda entry: entry.field.annotation is bool)
    of_kind = [f"kind = {one_of(get_args(e.model.model_fields['kind'].annotation))}" for e in found if e.table == here]
    return of_kind[:1] or list(dict.fromkeys(entry.text for entry in found))[:2]
