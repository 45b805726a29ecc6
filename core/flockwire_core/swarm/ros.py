"""The table [ros] of a swarm file: the swarm in ROS 2."""

from __future__ import annotations

import re
from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from flockwire_core.swarm.tables import Model
from flockwire_core.swarm.wording import Takes

HIGHEST_DOMAIN = 232
LOWEST_PORT, HIGHEST_PORT = 1, 65535
_NAME = re.compile(r"(/[A-Za-z_]\w*)+")
_ADDRESS = re.compile(r"(?:\[(?P<v6>[0-9A-Fa-f:.]+)\]|(?P<host>[A-Za-z0-9.-]+)):(?P<port>[0-9]{1,5})")


def absolute_name(text: str) -> str:
    """Return `text` if it is an absolute name in ROS; raises ValueError."""
    if not _NAME.fullmatch(text):
        raise ValueError("must be an absolute ROS name like /leader/cmd_vel: letters, digits and _ after each /")
    return text


def _namespace(text: str) -> str:
    return "/" if text == "/" else absolute_name(text)


def _prefix(text: str) -> str:
    if not re.fullmatch(r"(\w+/)*\w*", text):
        raise ValueError("must be letters, digits, _ and / between them")
    return text


def _address(text: str) -> str:
    found = _ADDRESS.fullmatch(text)
    if found is None or not LOWEST_PORT <= int(found["port"]) <= HIGHEST_PORT:
        raise ValueError("must be ADDRESS:PORT, as 127.0.0.1:7447 (IPv6: [IP]:PORT)")
    return text


RouterAddress = Annotated[str, AfterValidator(_address), Takes("an address and a port like 127.0.0.1:7447")]
Domain = Annotated[int, Field(ge=0, le=HIGHEST_DOMAIN)]


class Ros(Model):
    """The swarm in ROS 2, over rmw_zenoh (docs/ros.md)."""

    router: RouterAddress = "127.0.0.1:7447"  # address and port of rmw_zenohd
    serve: bool = False  # whether the ros process is that router, where no rmw_zenohd runs
    domain: Domain = 0  # ROS_DOMAIN_ID
    namespace: Annotated[str, AfterValidator(_namespace), Takes("an absolute ROS name")] | None = (
        None  # of topics and services; default: / and the swarm's name
    )
    frame_prefix: Annotated[str, AfterValidator(_prefix), Takes("letters, digits, _ and /")] = (
        ""  # before the names of the drones' frames
    )
    orders: tuple[Literal["start", "formation", "hold", "land", "stop"], ...] = ()  # obeyed; others are refused


def namespace_of(swarm_name: str, table: Ros) -> str:
    """Return the namespace of a swarm's topics and services, with its leading slash."""
    return f"/{swarm_name}" if table.namespace is None else table.namespace
