"""The hash of a message's or a service's definition, which is part of each key of rmw_zenoh.

    RIHS01_ + SHA-256 of the type description as JSON        (REP 2011, rosidl's type_description.py)

The description names each field with the number of its type; constants and default values are not part of it.
"""

from __future__ import annotations

import hashlib
import json
import re
from functools import cache
from typing import Any

from flockwire_core.ros.definitions import MESSAGES, SERVICES

PREFIX = "RIHS01_"
NESTED = 1
NUMBERS = {
    "int8": 2, "uint8": 3, "int16": 4, "uint16": 5, "int32": 6, "uint32": 7, "int64": 8, "uint64": 9,
    "float32": 10, "float64": 11, "char": 3, "bool": 15, "byte": 16, "string": 17,
}  # fmt: skip
ARRAY, BOUNDED, UNBOUNDED = 48, 96, 144  # added to the number of the elements' type
EVENT_INFO = "service_msgs/msg/ServiceEventInfo"
NOTHING = "uint8 structure_needs_at_least_one_member"  # the field of a message without one
_FIELD = re.compile(r"([\w/]+)(?:\[((?:<=)?\d+|)\])?\s+(\w+)(\s*=.*|\s.*|)")

Field = dict[str, Any]


@cache
def type_hash(ros_type: str) -> str:
    """Return the hash of a message or a service of definitions.py; KeyError for another one."""
    definitions = MESSAGES
    if ros_type in SERVICES:
        definitions = MESSAGES | service_parts(ros_type, *SERVICES[ros_type])
    return rihs01(ros_type, definitions)


def rihs01(ros_type: str, definitions: dict[str, str]) -> str:
    """Return the hash of `ros_type`, of which `definitions` has the text and those of all that it needs.

    Raises KeyError if one is missing, ValueError for a line that is not understood.
    """
    needed: dict[str, list[Field]] = {}
    queue = [ros_type]
    while queue:
        name = queue.pop()
        if name not in needed:
            needed[name] = fields(name, definitions[name])
            queue += [field["type"]["nested_type_name"] for field in needed[name] if field["type"]["nested_type_name"]]
    description = {
        "type_description": {"type_name": ros_type, "fields": needed.pop(ros_type)},
        "referenced_type_descriptions": [{"type_name": name, "fields": needed[name]} for name in sorted(needed)],
    }
    return PREFIX + hashlib.sha256(json.dumps(description).encode()).hexdigest()


def service_parts(ros_type: str, request: str, response: str) -> dict[str, str]:
    """Return the definitions of a service and of its three messages, as rosidl derives them."""
    needs = f"{ros_type}_Request", f"{ros_type}_Response", f"{ros_type}_Event"
    return {
        ros_type: f"{needs[0]} request_message\n{needs[1]} response_message\n{needs[2]} event_message",
        needs[0]: request,
        needs[1]: response,
        needs[2]: f"{EVENT_INFO} info\n{needs[0]}[<=1] request\n{needs[1]}[<=1] response",
    }


def fields(ros_type: str, text: str) -> list[Field]:
    """Return the fields of the definition `text`; ValueError for a line that is not understood."""
    found = []
    for line in filter(None, (line.partition("#")[0].strip() for line in (text or NOTHING).splitlines())):
        parts = _FIELD.fullmatch(line)
        if parts is None:
            raise ValueError(f"{ros_type}: {line!r} is no field of a message")
        kind, length, name, rest = parts.groups()
        if not rest.lstrip().startswith("="):  # else it is a constant
            number, nested = _number(kind)
            added, capacity = _of_array(length) if length is not None else (0, 0)
            form = {"type_id": number + added, "capacity": capacity, "string_capacity": 0, "nested_type_name": nested}
            found.append({"name": name, "type": form})
    return found


def _of_array(length: str) -> tuple[int, int]:
    """Return what is added to the number of the elements' type, and the most elements, of what is in the brackets."""
    if not length:
        return UNBOUNDED, 0
    return (BOUNDED if length.startswith("<=") else ARRAY), int(length.removeprefix("<="))


def _number(kind: str) -> tuple[int, str]:
    """Return the number of a field's type, and the name of a nested one."""
    if kind in NUMBERS:
        return NUMBERS[kind], ""
    if "/" not in kind:
        raise ValueError(f"{kind!r} is no type of ROS 2, and names no package")
    parts = kind.split("/")
    return NESTED, kind if len(parts) == 3 else f"{parts[0]}/msg/{parts[1]}"
