"""The table [ros] of a swarm file: the swarm in ROS 2."""

from __future__ import annotations

import re
from typing import Annotated, Literal

from pydantic import Field

from flockwire_core.swarm.tables import Form, Items, Model, key

LOWEST_PORT, HIGHEST_PORT = 1, 65535
_ADDRESS = re.compile(r"(?:\[(?P<v6>[0-9A-Fa-f:.]+)\]|(?P<host>[A-Za-z0-9.-]+)):(?P<port>[0-9]{1,5})")
is_absolute = re.compile(r"(/[A-Za-z_]\w*)+").fullmatch


def _is_address(text: str) -> bool:
    found = _ADDRESS.fullmatch(text)
    return found is not None and LOWEST_PORT <= int(found["port"]) <= HIGHEST_PORT


AbsoluteName = Annotated[
    str, Form("an absolute ROS name like /leader/cmd_vel: letters, digits and _ after each /", is_absolute)
]
Namespace = Annotated[str, Form("an absolute ROS name or /", re.compile(r"/|(/[A-Za-z_]\w*)+").fullmatch)]
Prefix = Annotated[str, Form("letters, digits, _ and / between them", re.compile(r"(\w+/)*\w*").fullmatch)]
RouterAddress = Annotated[str, Form("ADDRESS:PORT, as 127.0.0.1:7447 (IPv6: [IP]:PORT)", _is_address)]
Domain = Annotated[int, Field(ge=0, le=232)]  # the highest whose ports exist


class Ros(Model):
    """The swarm in ROS 2, over rmw_zenoh (docs/ros.md)."""

    router: RouterAddress = key("127.0.0.1:7447", "address and port of rmw_zenohd")
    serve: bool = key(False, "whether the ros process is that router, where no rmw_zenohd runs")
    domain: Domain = key(0, "ROS_DOMAIN_ID")
    namespace: Namespace | None = key(None, "of topics and services; default: / and the swarm's name")
    frame_prefix: Prefix = key("", "before the names of the drones' frames")
    orders: Items[Literal["start", "formation", "hold", "land", "stop"]] = key((), "obeyed; others are refused")


def namespace_of(swarm_name: str, table: Ros) -> str:
    """Return the namespace of a swarm's topics and services, with its leading slash."""
    return f"/{swarm_name}" if table.namespace is None else table.namespace
