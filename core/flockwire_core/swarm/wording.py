"""Bad inputs, and the values and suggestions in their messages."""

from __future__ import annotations

from collections.abc import Iterable
from datetime import date, time

LONGEST = 60  # characters of a value that are shown


class InputError(ValueError):
    """A bad input, which a command refuses; each line of the text names a key, a file or an option, and the rule."""


def one_of(words: Iterable[str]) -> str:
    """Return words as alternatives."""
    *others, last = [f"'{word}'" for word in words]
    return f"{', '.join(others)} or {last}" if others else last


def beside(value: float, limit: float) -> str:
    """Return a value with two decimals, or as many more as tell it from the `limit` that it breaks, as shown."""
    for decimals in range(2, 15):
        if float(text := f"{value:.{decimals}f}") != float(f"{limit:g}"):
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
    if isinstance(value, date | time):
        return value.isoformat()
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
