"""The keys of a TOML file from its models: place, allowed values, and the comment after each field.

Pages, schemas and refusals use them, so a key is described in one place: the field of its model.
"""

from __future__ import annotations

import ast
import inspect
import io
import re
import sys
import tokenize
from collections.abc import Iterator
from functools import cache
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, NamedTuple, Union, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

UNITS = ("m", "s", "m/s", "m/s^2", "rad", "rad/s", "1/s", "Hz", "s per s", "degrees", "%")


class Place(NamedTuple):
    """The target of a location in a model: the keys on the way, and its type (None if unknown)."""

    keys: tuple[str | int, ...]
    kind: Any
    metadata: tuple[Any, ...]

    @property
    def text(self) -> str:
        """The dotted key, with list positions from 0."""
        return ".".join(map(str, self.keys))


class Entry(NamedTuple):
    """One key of a table: the table's dotted path, its models, its field."""

    table: str
    model: type[BaseModel]
    name: str
    field: FieldInfo

    @property
    def text(self) -> str:
        """The dotted key."""
        return f"{self.table}.{self.name}" if self.table else self.name


def plain(annotation: Any, metadata: tuple[Any, ...] = ()) -> tuple[Any, tuple[Any, ...]]:  # noqa: ANN401  (any type)
    """Return a type without `Annotated` and without None, and all metadata on the way."""
    while True:
        if get_origin(annotation) is Annotated:
            annotation, *more = get_args(annotation)
            metadata += tuple(more)
        elif get_origin(annotation) in (Union, UnionType):
            members = [member for member in get_args(annotation) if member is not NoneType]
            if len(members) > 1:
                return Union[tuple(members)], metadata  # noqa: UP007  (made of a tuple)
            annotation = members[0]
        else:
            return annotation, metadata


def of_field(field: FieldInfo) -> tuple[Any, tuple[Any, ...]]:
    """Return the plain type of a field, and its metadata."""
    kind, metadata = plain(field.annotation, tuple(field.metadata))
    return kind, (field, *metadata)


def kinds(annotation: Any) -> dict[str, type[BaseModel]]:  # noqa: ANN401  (any type)
    """Return the models of a union with the discriminator `kind`, by kind; empty for any other type."""
    if get_origin(annotation) not in (Union, UnionType):
        return {}
    found = {}
    for member in get_args(annotation):
        field = member.model_fields.get("kind") if is_model(member) else None
        if field is None or get_origin(field.annotation) is not Literal:
            return {}
        found[str(get_args(field.annotation)[0])] = member
    return found


def is_model(annotation: Any) -> bool:  # noqa: ANN401  (any type)
    """Return whether `annotation` is a model."""
    return isinstance(annotation, type) and issubclass(annotation, BaseModel)


def place(model: type[BaseModel], location: tuple[str | int, ...]) -> Place:
    """Follow a location of a validation error; the kind of a table in it is not a key of the file."""
    keys: list[str | int] = []
    kind: Any = model
    metadata: tuple[Any, ...] = ()
    for part in location:
        members = kinds(kind)
        if members and part in members:
            kind, metadata = members[str(part)], ()
            continue
        keys.append(part)
        kind, metadata = _inside(kind, part)
    return Place(tuple(keys), kind, metadata)


def _inside(kind: Any, part: str | int) -> tuple[Any, tuple[Any, ...]]:  # noqa: ANN401  (any type)
    """Return the type at `part` of a type, None if unknown."""
    if is_model(kind):
        named = {field.alias or name: field for name, field in kind.model_fields.items()}
        return of_field(named[str(part)]) if part in named else (None, ())
    arguments = get_args(kind)
    if get_origin(kind) is dict:
        return plain(arguments[1])
    if get_origin(kind) is tuple and isinstance(part, int):
        if arguments[-1] is Ellipsis:
            return plain(arguments[0])
        return plain(arguments[part]) if part < len(arguments) else (None, ())
    return None, ()


def entries(model: type[BaseModel], table: str = "") -> Iterator[Entry]:
    """Yield every key below a model, in the file's order; NAME means a name, N a position in a list."""
    inner: list[tuple[str, type[BaseModel]]] = []
    for name, field in model.model_fields.items():
        if field.exclude or field.repr is False:
            continue
        entry = Entry(table, model, field.alias or name, field)
        yield entry
        inner += [(entry.text + suffix, found) for suffix, found in _tables(of_field(field)[0])]
    for path, found in inner:
        yield from entries(found, path)


def _tables(kind: Any) -> list[tuple[str, type[BaseModel]]]:  # noqa: ANN401  (any type)
    """Return the models of a type, each with the path between."""
    if is_model(kind):
        return [("", kind)]
    if members := kinds(kind):
        return [("", member) for member in members.values()]
    if get_origin(kind) is dict:
        return [(f".NAME{suffix}", found) for suffix, found in _tables(plain(get_args(kind)[1])[0])]
    if get_origin(kind) is tuple:
        return [(f".N{suffix}", found) for suffix, found in _tables(plain(get_args(kind)[0])[0])]
    return []


def explanation(model: type[BaseModel], name: str) -> tuple[str, str]:
    """Return unit and meaning of a field from the comment after it: `# m/s, its speed`."""
    for owner in model.__mro__[: model.__mro__.index(BaseModel)]:
        comments = _comments(owner.__module__).get(owner.__name__, {})
        if name in comments:
            first, _, rest = comments[name].partition(", ")
            return (first, rest) if first in UNITS else ("", comments[name])
    return "", ""


_LINTERS = re.compile(r"# noqa[^#]*")  # a comment for the linter


@cache
def _comments(module: str) -> dict[str, dict[str, str]]:
    """Return the comments after the fields of each class of a module."""
    source = inspect.getsource(sys.modules[module])
    tokens = tokenize.generate_tokens(io.StringIO(source).readline)
    comments = ((token.start[0], _LINTERS.sub("", token.string)) for token in tokens if token.type == tokenize.COMMENT)
    by_line = {line: comment.lstrip("# ") for line, comment in comments}
    found: dict[str, dict[str, str]] = {}
    for node in ast.parse(source).body:
        if isinstance(node, ast.ClassDef):
            found[node.name] = {
                line.target.id: comment
                for line in node.body
                if isinstance(line, ast.AnnAssign) and isinstance(line.target, ast.Name)
                for number in range(line.lineno, 1 + (line.end_lineno or line.lineno))
                for comment in [by_line.get(number)]
                if comment
            }
    return found
