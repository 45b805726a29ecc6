"""The ROS graph on Zenoh: data keys, and the liveliness tokens by which nodes find each other.

    data     DOMAIN/TOPIC/TYPE/HASH
    token    @ros2_lv/DOMAIN/SESSION/NODE/NODE/NN/ENCLAVE/NAMESPACE/NAME
    token    @ros2_lv/DOMAIN/SESSION/NODE/ENTITY/KIND/ENCLAVE/NAMESPACE/NAME/TOPIC/TYPE/HASH/QOS

Source: rmw_zenoh, docs/design.md and liveliness_utils.cpp (0.2.4 and newer). In a token `%` replaces each `/`.
The tokens of those who publish a topic tell why nothing arrives on it.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Collection, Iterable
from enum import StrEnum
from typing import NamedTuple

from flockwire_core.ros.messages import HASHES

TOKENS = "@ros2_lv"
NODE, NODE_PARTS, END_PARTS = "NN", 9, 13  # of a token: the kind of a node, parts of a node's and of an end's
_DOMAIN = re.compile("[0-9]{1,3}")
_TOKEN = re.compile(r"[\w@/%:,.~-]+", re.ASCII)  # what names, types and qualities of service have


class EndKind(StrEnum):
    """The kind of an end of a topic or a service."""

    PUBLISHER = "MP"
    SUBSCRIPTION = "MS"
    SERVER = "SS"
    CLIENT = "SC"


class Qos(NamedTuple):
    """The quality of service of an end, as a token has it; deadline, lifespan and liveliness are the defaults."""

    reliable: bool = True
    latched: bool = False  # transient local: the newest messages are sent to late joiners
    depth: int = 10

    @property
    def text(self) -> str:
        """The part of the token: a default is empty."""
        return f"{'' if self.reliable else 2}:{1 if self.latched else ''}:,{self.depth}:,:,:,,"


DEFAULT = Qos()
LATCHED = Qos(latched=True, depth=1)


class Node(NamedTuple):
    """One node: its ROS domain, the id of its Zenoh session, its number there, its namespace and its name."""

    domain: int
    session: str
    number: int
    namespace: str  # with its leading slash
    name: str

    @property
    def token(self) -> str:
        """The token by which others see the node."""
        return self._head(self.number, NODE)

    def end(self, number: int, kind: EndKind, name: str, ros_type: str, qos: Qos = DEFAULT) -> str:
        """Return the token of the end `number` of the topic or service `name`, an absolute name."""
        return "/".join((self._head(number, kind), mangled(name), dds_type(ros_type), HASHES[ros_type], qos.text))

    def _head(self, number: int, kind: str) -> str:
        where = f"{TOKENS}/{self.domain}/{self.session}/{self.number}/{number}/{kind}"
        return f"{where}/%/{mangled(self.namespace)}/{self.name}"


class End(NamedTuple):
    """What a token tells of an end of a topic or a service."""

    domain: int
    kind: str
    node: str  # its absolute name
    name: str
    dds_type: str
    type_hash: str


def data_key(domain: int, name: str, ros_type: str) -> str:
    """Return the key of the messages of a topic, or of the requests of a service, of the absolute name `name`."""
    return f"{domain}/{name.strip('/')}/{dds_type(ros_type)}/{HASHES[ros_type]}"


def topic_of(key: str) -> str:
    """Return the absolute name of the topic of a data key."""
    return "/" + "/".join(key.split("/")[1:-2])


def dds_type(ros_type: str) -> str:
    """Return the name of a type as DDS has it: package::msg::dds_::Type_."""
    package, room, name = ros_type.split("/")
    return f"{package}::{room}::dds_::{name}_"


def mangled(name: str) -> str:
    """Return a name as a part of a token; an empty one is that of the root."""
    return name.replace("/", "%") or "%"


def publisher_id(token: str) -> bytes:
    """Return the 16 bytes that identify the owner of `token` in its attachments; receivers need only unique ones."""
    return hashlib.blake2b(token.encode(), digest_size=16).digest()


def is_node(token: str) -> bool:
    """Return whether `token` is that of a node, which tells of no end."""
    return token.count("/") == NODE_PARTS - 1 and f"/{NODE}/" in token


def read_end(token: str) -> End | None:
    """Return what `token` tells; None for that of a node, and for one of another form.

    Its names are safe to show: whoever reaches the router can have published it.
    """
    # characters of one that is read: names of ROS have at most 256 each
    if len(token) > 1024 or not _TOKEN.fullmatch(token):
        return None
    parts = token.split("/")
    if len(parts) not in (END_PARTS, END_PARTS + 1) or parts[0] != TOKENS:  # Lyrical may append its kinds of buffer
        return None
    if parts[5] not in set(EndKind) or not _DOMAIN.fullmatch(parts[1]):
        return None
    namespace, name = parts[7].replace("%", "/"), parts[9].replace("%", "/")
    return End(int(parts[1]), parts[5], f"{namespace.rstrip('/')}/{parts[8]}", name, parts[10], parts[11])


def advice(publishers: Iterable[End], domain: int, name: str, ros_types: Collection[str], key: str) -> str:
    """Return why no message of `ros_types` arrives on the topic `name`, in which `*` is any part.

    `publishers` are those of all domains; `key` is that of the domain.
    """
    pattern = re.compile(re.escape(name).replace(r"\*", "[^/]+"))
    found = [end for end in publishers if pattern.fullmatch(end.name)]
    here = [end for end in found if end.domain == domain]
    wanted = dict(zip(map(dds_type, ros_types), ros_types, strict=True))
    if not found:
        return f"no node publishes {name}: check its name with `ros2 topic list`"
    if not here:
        return f"{found[0].name} is published in domain {found[0].domain}: set {key}"
    for end in here:
        if end.dds_type not in wanted:
            return f"{end.name} has messages of {end.dds_type}: must be of {' or '.join(wanted)}"
        if end.type_hash != HASHES[wanted[end.dds_type]]:
            other = f"another version of {end.dds_type} ({end.type_hash})"
            return f"{end.name} has messages of {other}: use ROS 2 Jazzy or newer"
    return f"{here[0].node} announces {here[0].name}, but publishes nothing"
