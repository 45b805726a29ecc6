"""The page of all keys of a swarm file (docs/swarm_file.md) and its JSON Schema, from the models."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, get_args

from pydantic import BaseModel
from pydantic_core import PydanticUndefined

from flockwire.swarm.model import Swarm
from flockwire.swarm.outline import Entry, entries, explanation, of_field
from flockwire.swarm.wording import shown, takes

_HEAD = """# The swarm file

<!-- made by scripts/document from the models in core/flockwire/swarm; change those -->

One TOML file describes a whole swarm. `flockwire init` writes one with comments, `flockwire check` names every mistake.
Lengths are metres, times seconds, angles radians; the world frame is ENU with Z up. A key without a default must be
given. In messages and dotted keys, list positions count from 0: `drones.2.start` is the start of the third drone.

An editor that knows TOML and JSON Schema (Even Better TOML, taplo) completes and explains keys: `flockwire init` writes
`.flockwire/swarm.schema.json` and a first line that names it."""


def page() -> str:
    """Return the page."""
    parts = [_HEAD]
    written: set[type[BaseModel]] = set()
    every = list(entries(Swarm))
    for entry in every:
        if entry.model in written:
            continue
        written.add(entry.model)
        tables = dict.fromkeys(other.table for other in every if other.model is entry.model)
        parts += ["", *_section(entry, tuple(tables))]
    return "\n".join(parts) + "\n"


def _section(first: Entry, tables: tuple[str, ...]) -> Iterator[str]:
    """Yield heading, purpose and keys of one table."""
    yield f"## {' and '.join(_heading(table) for table in tables)}{_kind_of(first.model)}"
    yield ""
    yield (first.model.__doc__ or "").strip().split("\n")[0]
    yield ""
    yield "| key | default | unit | must be | |"
    yield "|---|---|---|---|---|"
    for entry in entries(first.model):
        if not entry.table:
            unit, meaning = explanation(entry.model, entry.name)
            cells = f"`{entry.name}`", default(entry), unit, takes(*of_field(entry.field)), meaning
            yield f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |"


def _heading(table: str) -> str:
    if not table:
        return "The top of the file"
    return f"`[[{table.removesuffix('.N')}]]`" if table.endswith(".N") else f"`[{table}]`"


def _kind_of(model: type[BaseModel]) -> str:
    field = model.model_fields.get("kind")
    if field is None or len(get_args(field.annotation)) != 1:
        return ""
    return f', kind = "{get_args(field.annotation)[0]}"'


def default(entry: Entry) -> str:
    """Return the default of a key."""
    value = entry.field.default
    if value is PydanticUndefined:
        return "must be given"
    if value is None:
        return "none"
    if isinstance(value, BaseModel) or (
        isinstance(value, dict) and any(isinstance(v, BaseModel) for v in value.values())
    ):
        return "its own defaults"
    return f"`{shown(value)}`"


def schema() -> dict[str, Any]:
    """Return the JSON Schema of a swarm file, with the page's description of each key."""
    made = Swarm.model_json_schema()
    described = {"Swarm": made, **made["$defs"]}
    for model, table in ((model, described[model.__name__]) for model in _models()):
        for entry in entries(model):
            if not entry.table:
                unit, meaning = explanation(model, entry.name)
                table["properties"][entry.name] |= {"description": ", ".join(filter(None, (unit, meaning)))}
        for hidden in [name for name, field in model.model_fields.items() if field.repr is False]:
            del table["properties"][hidden]
    plain = _plain(made, made["$defs"])
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **plain, "title": "flockwire swarm file"}


def _plain(part: Any, tables: dict[str, Any]) -> Any:  # noqa: ANN401  (JSON)
    """Return a part of a schema without alternatives for null and for a table's kind.

    TOML has no null. A table is checked by its kind only; `oneOf` would check it by all kinds.
    """
    if isinstance(part, list):
        return [_plain(inner, tables) for inner in part]
    if not isinstance(part, dict):
        return part
    given = [choice for choice in part.get("anyOf", ()) if choice != {"type": "null"}]
    if len(given) == 1:
        part = {**given[0], **{key: inner for key, inner in part.items() if key != "anyOf"}}
    found = {key: _plain(inner, tables) for key, inner in part.items() if key not in ("oneOf", "discriminator")}
    return found | _by_kind(part["discriminator"]["mapping"], tables) if "discriminator" in part else found


def _by_kind(names: dict[str, str], tables: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of a table that is one of `tables`, by kind; an editor offers all keys."""
    kind: dict[str, Any] = {"properties": {"kind": {"enum": list(names)}}, "required": ["kind"]}
    cases = [{"if": {"properties": {"kind": {"const": one}}}, "then": {"$ref": name}} for one, name in names.items()]
    keys = {
        key: {"description": table.get("description", "")}
        for name in names.values()
        for key, table in tables[name.rpartition("/")[2]]["properties"].items()
    }
    return {
        "type": "object",
        "properties": keys | kind["properties"],
        "required": ["kind"],
        "allOf": [{"if": kind, "then": {"allOf": cases}}],
    }


def _models() -> list[type[BaseModel]]:
    return list(dict.fromkeys(entry.model for entry in entries(Swarm)))
