"""The allowed values of a key, in words: the same in refusals, on the page of all keys and in editors."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Literal, get_args, get_origin

from flockwire_core.swarm.outline import is_model, kinds, plain

LONGEST = 60  # characters of a value that are shown
_SIMPLE = {bool: "true or false", int: "a whole number", float: "a number", str: "text in quotes"}
_NUMBERS = {1: "one number", 2: "two numbers", 3: "three numbers"}


@dataclass(frozen=True, slots=True)
class Takes:
    """The text of allowed values, if the type does not give it."""

    text: str


def takes(kind: Any, metadata: tuple[Any, ...] = ()) -> str:  # noqa: ANN401  (any type)
    """Return the allowed values of a type, to follow `must be`; empty if unknown."""
    said = [data.text for data in metadata if isinstance(data, Takes)]
    if said:
        return said[0]
    if kind in _SIMPLE:
        return _bounded(_SIMPLE[kind], metadata)
    if get_origin(kind) is Literal:
        return one_of(map(str, get_args(kind)))
    return _list(kind, metadata) if get_origin(kind) is tuple else _table(kind)


def _table(kind: Any) -> str:  # noqa: ANN401  (any type)
    """Return the text of a table."""
    if is_model(kind):
        return "a table, { … }"
    if members := kinds(kind):
        return f"a table whose kind is {one_of(members)}"
    if get_origin(kind) is not dict:
        return ""
    inner = plain(get_args(kind)[1])[0]
    return "a table of tables, each with a name" if is_model(inner) or kinds(inner) else "a table, { … }"


def _list(kind: Any, metadata: tuple[Any, ...]) -> str:  # noqa: ANN401  (any type)
    """Return the text of a list."""
    first, *rest = get_args(kind)
    if rest == [Ellipsis]:
        inner = takes(*plain(first))
        least = " with one item at least" if any(getattr(data, "min_length", None) for data in metadata) else ""
        most = next((data.max_length for data in metadata if getattr(data, "max_length", None)), None)
        return f"a list{least}{f' of up to {most} items' if most else ''}" + (f", each item {inner}" if inner else "")
    if plain(first)[0] is float:
        return f"{_NUMBERS[1 + len(rest)]}{' [x, y, z]' if len(rest) == 2 else ''}"
    return f"a list of {1 + len(rest)}"


def _bounded(what: str, metadata: Iterable[Any]) -> str:
    """Return `what` with the bounds that the metadata have."""
    bounds: dict[str, float] = {}
    for data in (inner for outer in metadata for inner in (outer, *getattr(outer, "metadata", ()))):
        for sign in ("gt", "ge", "lt", "le"):
            if getattr(data, sign, None) is not None:
                bounds[sign] = getattr(data, sign)
    words = {"gt": "above {:g}", "ge": "of {:g} or more", "lt": "below {:g}", "le": "of {:g} or less"}
    if {"ge", "le"} <= bounds.keys():
        return f"{what} from {bounds['ge']:g} to {bounds['le']:g}"
    return " ".join([what, " and ".join(words[sign].format(value) for sign, value in bounds.items())]).strip()


def one_of(words: Iterable[str]) -> str:
    """Return words as alternatives."""
    *others, last = [f"'{word}'" for word in words]
    return f"{', '.join(others)} or {last}" if others else last


def beside(value: float, limit: float) -> str:
    """Return a value with two decimals, or as many more as tell it from the `limit` that it breaks."""
    for decimals in range(2, 15):
        if float(text := f"{value:.{decimals}f}") != limit:
            return text
    return repr(value)


def meant(value: object, words: Iterable[str]) -> str:
    """Return the suggestion of the nearest of `words` for `value`, to follow a refusal; empty if none is near."""
    from difflib import get_close_matches  # noqa: PLC0415  (a file without mistakes needs none)

    near = get_close_matches(str(value), [*words], n=1)
    return f"; did you mean {near[0]!r}?" if near else ""


def shown(value: object) -> str:
    """Return a value in TOML form, shortened."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, dict):
        return _cut("{ " + ", ".join(f"{key} = {shown(inner)}" for key, inner in value.items()) + " }")
    if isinstance(value, list | tuple):
        return _cut("[" + ", ".join(map(shown, value)) + "]")
    return _cut(repr(value))


def printable(text: str) -> str:
    """Return `text` as a terminal may show it: control characters but line breaks are escaped."""
    return "".join(
        character if character.isprintable() or character == "\n" else repr(character)[1:-1] for character in text
    )


def _cut(text: str) -> str:
    return text if len(text) <= LONGEST else f"{text[:LONGEST]}…"
