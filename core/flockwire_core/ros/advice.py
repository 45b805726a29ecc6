"""Why nothing arrives on a topic that is received, from the tokens of those who publish: one line with the remedy."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable

from flockwire_core.ros.graph import End, dds_type
from flockwire_core.ros.type_hash import type_hash


def advice(publishers: Iterable[End], domain: int, name: str, ros_types: Collection[str], key: str) -> str:
    """Return why no message of `ros_types` arrives on the topic `name`, in which `*` is any part.

    `publishers` are those of all domains; `key` is that of the domain.
    """
    pattern = re.compile(re.escape(name).replace(r"\*", "[^/]+"))
    found = [end for end in publishers if pattern.fullmatch(end.name)]
    here = [end for end in found if end.domain == domain]
    wanted = {dds_type(one): one for one in ros_types}
    if not found:
        return f"no node publishes {name}: check its name with `ros2 topic list`"
    if not here:
        return f"{found[0].name} is published in domain {found[0].domain}: set {key}"
    for end in here:
        if end.dds_type not in wanted:
            return f"{end.name} has messages of {end.dds_type}: must be of {' or '.join(wanted)}"
        if end.type_hash != type_hash(wanted[end.dds_type]):
            other = f"another version of {end.dds_type} ({end.type_hash})"
            return f"{end.name} has messages of {other}: use ROS 2 Jazzy or newer"
    return f"{here[0].node} announces {here[0].name}, but publishes nothing"
