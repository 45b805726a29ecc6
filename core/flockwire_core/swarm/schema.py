"""The JSON Schema of a swarm file and the text of its defaults, from the models."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel
from pydantic_core import PydanticUndefined

from flockwire_core.swarm.model import Swarm
from flockwire_core.swarm.outline import Entry, entries, explanation
from flockwire_core.swarm.wording import shown


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
    for model in dict.fromkeys(entry.model for entry in entries(Swarm)):
        table = described[model.__name__]
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
