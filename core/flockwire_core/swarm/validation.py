"""The content of a file as a model; pydantic's errors become problems: key, value, rule.

pydantic's texts name branches of unions and Python types, and suggest no key: they are not used.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple, TypeVar

from pydantic import BaseModel, ValidationError

from flockwire_core.swarm.outline import Outline
from flockwire_core.swarm.wording import meant, one_of, shown

MOST = 100  # problems of a file that are named
MORE = "{count} more values or keys are wrong"
NO_DEFAULT = "missing; this key has no default"
Made = TypeVar("Made", bound=BaseModel)


class Problem(NamedTuple):
    """One problem of a file: a dotted key (list positions from 0), the rule, and the value in TOML form.

    A rule of a whole swarm leaves out the value (None): it is the swarm's.
    """

    key: str
    rule: str
    value: str | None = None

    def __str__(self) -> str:
        return f"{self.key}{f' = {self.value}' if self.value else ''}{': ' if self.key else ''}{self.rule}"

    def of(self, content: BaseModel) -> Problem:
        """Return it with the value that the model of the file has at the key, unless it has one."""
        if self.value is not None:
            return self
        value: object = content
        for part in self.key.split("."):
            value = _inside(value, part)
        is_table = isinstance(value, BaseModel | dict) or (
            isinstance(value, tuple) and any(isinstance(one, BaseModel) for one in value)
        )
        return self._replace(value="" if value is None or is_table else shown(value))


def _inside(value: object, part: str) -> object:
    """Return the value of a key or a list position in a part of a model; None if there is none."""
    if isinstance(value, dict):
        return value.get(part)
    if isinstance(value, tuple):
        return value[int(part)] if part.isdigit() else None
    return getattr(value, part, None)


def validate(model: type[Made], table: Mapping[str, Any], origin: str, refusal: type[ValueError]) -> Made:
    """Return the content of the file `origin` as a `model`; raises `refusal` with a line for each problem."""
    try:
        return model.model_validate(table)
    except ValidationError as error:
        raise refusal("\n".join(f"{origin}: {one}" for one in problems_of(error, model))) from None


def problems_of(error: ValidationError, model: type[BaseModel]) -> list[Problem]:
    """Return the first MOST errors of `model`, in the order of its keys, and how many there are besides."""
    outline, details = Outline(model), error.errors(include_url=False)
    found = [_problem(outline, dict(detail)) for detail in details[:MOST]]
    if len(details) > MOST:
        found.append(Problem("", MORE.format(count=len(details) - MOST)))
    return list(dict.fromkeys(found))


def _problem(outline: Outline, detail: dict[str, Any]) -> Problem:
    kind, location, value = detail["type"], detail["loc"], shown(detail["input"])
    if kind == "missing" and isinstance(location[-1], int):
        kind, location = "too_short", location[:-1]  # a list lacks an item
    keys, part = outline.at(location)
    key, must = ".".join(map(str, keys)), outline.takes(part)
    match kind:
        case "value_error":
            return Problem(key, str(detail["ctx"]["error"]), value if keys else None)  # that of a file names its key
        case "extra_forbidden":
            return Problem(key, f"unknown key; {_suggestion(outline, keys, outline.at(location[:-1])[1])}", value)
        case "missing":
            return Problem(key, f"{NO_DEFAULT} and must be {must}" if must else NO_DEFAULT)
        case "union_tag_not_found" | "union_tag_invalid":
            return _unknown_kind(key, part["discriminator"]["propertyName"], outline.kinds(part), detail["input"])
    if kind.startswith("less_than") and part.get("unit"):
        must += f", in {part['unit']}"  # it may have been given in another one
    near = meant(detail["input"], part.get("enum", ()))
    return Problem(key, f"must be {must}{near}" if must else "this is not allowed here", value)


def _unknown_kind(key: str, name: str, kinds: Mapping[str, object], table: dict[str, object]) -> Problem:
    """Refuse the kind of a table, its key `name`, or its lack."""
    if name not in table:
        return Problem(f"{key}.{name}", f"missing; must be {one_of(kinds)}")
    return Problem(f"{key}.{name}", f"must be {one_of(kinds)}{meant(table[name], kinds)}", shown(table[name]))


def _suggestion(outline: Outline, keys: tuple[str | int, ...], table: dict[str, Any]) -> str:
    """Return the nearest known key to an unknown one of `table`, by spelling or in another table."""
    from difflib import get_close_matches  # noqa: PLC0415  (a file without mistakes needs none)

    *path, name = map(str, keys)
    siblings = [*table.get("properties", ())]
    close = get_close_matches(name, siblings, n=1) or [one for one in siblings if name in one.split("_")]
    near = [".".join((*path, one)) for one in close] or _elsewhere(outline, path, name)
    return f"did you mean {' or '.join(near)}?" if near else f"known here: {', '.join(siblings) or 'none'}"


def _elsewhere(outline: Outline, path: list[str], name: str) -> list[str]:
    """Return up to two keys of the whole file with this name, first from another kind of the same table."""
    here = ".".join("N" if key.isdigit() else key for key in path)
    found = [key for key in outline.entries() if key.name == name]
    of_kind = [f"kind = {shown(key.kind)}" for key in found if key.path == here and key.kind]
    found.sort(key=lambda key: key.part.get("type") == "boolean")  # switches last
    return of_kind[:1] or list(dict.fromkeys(key.text for key in found))[:2]
