"""The keys of a TOML file from the JSON Schema of its models: places, defaults, allowed values, meanings.

Pages, editors, `flockwire init` and refusals use it, so a key is described in one place: the field of its model.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

from pydantic import BaseModel
from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue

from flockwire_core.swarm.wording import one_of, shown

Part = dict[str, Any]  # the JSON Schema of a value
_SIMPLE = {
    "boolean": "true or false",
    "integer": "a whole number",
    "number": "a number",
    "string": "text in quotes",
    "object": "a table, { … }",
}
_NUMBERS = {1: "one number", 2: "two numbers", 3: "three numbers [x, y, z]"}


class Key(NamedTuple):
    """One key: the dotted path of its table (NAME is a name, N a position in a list), the table, name, value."""

    path: str
    table: Part
    name: str
    part: Part

    @property
    def text(self) -> str:
        """The dotted key."""
        return f"{self.path}.{self.name}" if self.path else self.name

    @property
    def kind(self) -> str:
        """The kind of its table, empty if tables have no kinds."""
        return str(self.table["properties"].get("kind", {}).get("const", ""))

    @property
    def unit(self) -> str:
        """Its unit, empty if it has none."""
        return str(self.part.get("unit", ""))

    @property
    def meaning(self) -> str:
        """What it is."""
        return str(self.part.get("meaning", ""))

    @property
    def default(self) -> str:
        """Its default, in TOML form if it is a value."""
        value = self.part.get("default")
        if self.name in self.table.get("required", ()):
            return "must be given"
        if value is None:
            return "none"
        return "its own defaults" if isinstance(value, dict) and value else f"`{shown(value)}`"


class _Generator(GenerateJsonSchema):
    """Makes schemas for TOML, which has no null; editors check a table by its kind only (`oneOf`: by all kinds).

    It keeps the order of the models, and accepts types of a user's model that JSON does not have.
    """

    def sort(self, value: JsonSchemaValue, parent_key: str | None = None) -> JsonSchemaValue:
        return value

    def handle_invalid_for_json_schema(self, schema: Any, error_info: str) -> JsonSchemaValue:  # noqa: ANN401
        return {}

    def nullable_schema(self, schema: Any) -> JsonSchemaValue:  # noqa: ANN401
        return self.generate_inner(schema["schema"])

    def tagged_union_schema(self, schema: Any) -> JsonSchemaValue:  # noqa: ANN401
        discriminator = super().tagged_union_schema(schema)["discriminator"]
        name, refs = discriminator["propertyName"], discriminator["mapping"]
        tables = [self.get_schema_from_definitions(ref) or {} for ref in refs.values()]
        offered: Part = {key: {} for table in tables for key in table["properties"]}  # by editors
        of_kind = [
            {"if": {"properties": {name: {"const": kind}}, "required": [name]}, "then": {"$ref": ref}}
            for kind, ref in refs.items()
        ]
        properties = offered | {name: {"enum": [*refs]}}
        return {"discriminator": discriminator, "type": "object", "properties": properties, "required": [name],
                "allOf": of_kind}  # fmt: skip


class Outline:
    """The keys of the files that `model` describes."""

    def __init__(self, model: type[BaseModel]) -> None:
        self.top: Part = model.model_json_schema(schema_generator=_Generator)

    def plain(self, part: Part) -> Part:
        """Return a schema; that of a table has the table's keys and its `purpose`."""
        if "$ref" not in part:
            return part
        table = self.top["$defs"][part["$ref"].rpartition("/")[2]]
        return {**table, "purpose": table.get("description", ""), **part}

    def kinds(self, part: Part) -> dict[str, Part]:
        """Return the tables of a value that has several kinds, by kind; else none."""
        names = part.get("discriminator", {}).get("mapping", {})
        return {kind: self.plain({"$ref": name}) for kind, name in names.items()}

    def entries(self, table: Part | None = None, path: str = "") -> Iterator[Key]:
        """Yield every key below a table (default: the file), in the file's order."""
        table = self.top if table is None else table
        found = [Key(path, table, name, part) for name, part in table.get("properties", {}).items()]
        yield from found
        for key in found:
            for suffix, inner in self._tables(key.part):
                yield from self.entries(inner, key.text + suffix)

    def _tables(self, part: Part) -> Iterator[tuple[str, Part]]:
        """Yield the tables in a value, each with the path between."""
        part = self.plain(part)
        yield from (("", kind) for kind in self.kinds(part).values() or ([part] if "properties" in part else []))
        for inner, suffix in ((part.get("additionalProperties"), ".NAME"), (part.get("items"), ".N")):
            if isinstance(inner, dict):
                yield from ((suffix + rest, table) for rest, table in self._tables(inner))

    def at(self, location: tuple[str | int, ...]) -> tuple[tuple[str | int, ...], Part]:
        """Return the keys of an error's location, and the schema there ({} if unknown).

        The kind of a table, and pydantic's names of alternatives, are no keys of the file.
        """
        keys: list[str | int] = []
        part = self.top
        for step in location:
            kinds = self.kinds(part)
            if step in kinds:
                part = kinds[str(step)]
            elif "anyOf" not in part and step != "[key]":
                keys.append(step)
                part = self.plain(_inside(part, step))
        return tuple(keys), part

    def takes(self, part: Part) -> str:
        """Return the allowed values, to follow `must be`; empty if unknown."""
        part = self.plain(part)
        if "takes" in part:
            return str(part["takes"])
        if kinds := self.kinds(part):
            return f"a table whose kind is {one_of(kinds)}"
        if "enum" in part or "const" in part:
            return one_of(map(str, part.get("enum", [part.get("const")])))
        match part.get("type"):
            case "array":
                return self._list(part)
            case "object" if any(suffix == ".NAME" for suffix, _ in self._tables(part)):
                return "a table of tables, each with a name"
            case kind:
                return _bounded(_SIMPLE.get(kind or "", ""), part)

    def _list(self, part: Part) -> str:
        """Return the text of a list."""
        fixed = part.get("prefixItems")
        if fixed:
            numbers = self.plain(fixed[0]).get("type") == "number"
            return _NUMBERS[len(fixed)] if numbers else f"a list of {len(fixed)}"
        least = " with one item at least" if "minItems" in part else ""
        most = f" of up to {part['maxItems']} items" if "maxItems" in part else ""
        inner = self.takes(part.get("items", {}))
        return f"a list{least}{most}" + (f", each item {inner}" if inner else "")


def _inside(part: Part, step: str | int) -> Part:
    """Return the schema of a key or an item of `part`, {} if it has none."""
    if isinstance(step, int):
        fixed = part.get("prefixItems", ())
        found = fixed[step] if step < len(fixed) else part.get("items")
    else:
        found = part.get("properties", {}).get(step, part.get("additionalProperties"))
    return found if isinstance(found, dict) else {}


def _bounded(what: str, part: Part) -> str:
    """Return `what` with its bounds."""
    if "minimum" in part and "maximum" in part:
        return f"{what} from {part['minimum']:g} to {part['maximum']:g}"
    words = {
        "exclusiveMinimum": "above {:g}",
        "minimum": "of {:g} or more",
        "exclusiveMaximum": "below {:g}",
        "maximum": "of {:g} or less",
    }
    return f"{what} {' and '.join(text.format(part[key]) for key, text in words.items() if key in part)}".strip()


def schema(model: type[BaseModel]) -> Part:
    """Return the JSON Schema of the files that `model` describes, for editors."""
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **Outline(model).top}
