"""The JSON Schema of a swarm file, for editors."""

from __future__ import annotations

from typing import Any

from flockwire_core.swarm.model import Swarm
from flockwire_core.swarm.outline import Outline, Part


def schema() -> Part:
    """Return the JSON Schema of a swarm file, with the page's description of each key."""
    outline = Outline(Swarm)
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        **_for_editors(outline.top, outline),
        "title": "flockwire swarm file",
    }


def _for_editors(part: Any, outline: Outline) -> Any:  # noqa: ANN401  (JSON)
    """Return a part of a schema without alternatives for null and for a table's kind; its unit is in its description.

    TOML has no null. A table is checked by its kind only; `oneOf` would check it by all kinds.
    """
    if isinstance(part, list):
        return [_for_editors(inner, outline) for inner in part]
    if not isinstance(part, dict):
        return part
    given = [choice for choice in part.get("anyOf", ()) if choice != {"type": "null"}]
    if len(given) == 1:
        part = {**given[0], **{key: inner for key, inner in part.items() if key != "anyOf"}}
    if isinstance(part.get("unit"), str):
        part = part | {"description": f"{part['unit']}, {part['description']}"}
    found = {
        key: inner if key == "default" else _for_editors(inner, outline)
        for key, inner in part.items()
        if key not in ("oneOf", "discriminator") and not (key in ("unit", "takes") and isinstance(inner, str))
    }
    kinds = outline.kinds(part)
    return found | _by_kind(kinds, part["discriminator"]["mapping"]) if kinds else found


def _by_kind(kinds: dict[str, Part], names: dict[str, str]) -> Part:
    """Return the schema of a table of several `kinds`, whose schemas have `names`; an editor offers all keys."""
    kind: Part = {"properties": {"kind": {"enum": list(kinds)}}, "required": ["kind"]}
    cases = [{"if": {"properties": {"kind": {"const": one}}}, "then": {"$ref": name}} for one, name in names.items()]
    keys = {
        key: {"description": part.get("description", "")}
        for table in kinds.values()
        for key, part in table["properties"].items()
    }
    return {
        "type": "object",
        "properties": keys | kind["properties"],
        "required": ["kind"],
        "allOf": [{"if": kind, "then": {"allOf": cases}}],
    }
