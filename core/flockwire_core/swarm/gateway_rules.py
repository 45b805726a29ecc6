"""The rules of a swarm file about its tracker: bodies, addresses, simulation."""

from __future__ import annotations

import ipaddress
from collections.abc import Iterator

from flockwire_core.swarm.model import Swarm
from flockwire_core.swarm.rules import Rule, needs

OLDEST, NEWEST = (3, 0), (4, 5)  # versions of NatNet


@needs("drones.id", "drones.body", "gateway.source", "tracked_obstacles", "avoidance.sensing")
def _bodies(swarm: Swarm) -> Iterator[str]:
    owners: dict[str | int, int] = {}
    for place, drone in enumerate(swarm.drones):
        body = swarm.body(drone.id)
        if isinstance(body, int) and swarm.gateway.source != "natnet":
            yield f"drones.{place}.body = {body}: only gateway.source = 'natnet' numbers bodies; must be a name"
        if body in owners:
            yield f"drones.{place}.body = {body!r}: drone {owners[body]} has this body"
        owners[body] = drone.id
    for place, obstacle in enumerate(swarm.tracked_obstacles):
        key = f"tracked_obstacles.{place}.body = {obstacle.body!r}"
        if obstacle.body in owners:
            yield f"{key}: drone {owners[obstacle.body]} has this body"
        if swarm.avoidance.sensing != "nearby":
            yield f"{key}: avoidance.sensing = {swarm.avoidance.sensing!r} does not sense it; must be 'nearby'"


@needs("gateway.natnet")
def _addresses(swarm: Swarm) -> Iterator[str]:
    table = swarm.gateway.natnet
    for key, text in (("server", table.server), ("interface", table.interface)):
        if not _is_ipv4(text, group=False):
            yield f"gateway.natnet.{key} = {text!r}: must be an IPv4 address of one host"
    if table.group is not None and not _is_ipv4(table.group, group=True):
        yield f"gateway.natnet.group = {table.group!r}: must be a multicast address, 224.0.0.0 to 239.255.255.255"


def _is_ipv4(text: str, group: bool) -> bool:
    try:
        return ipaddress.IPv4Address(text).is_multicast == group
    except ValueError:
        return False


@needs("gateway.source", "gateway.twin", "gateway.natnet")
def _twin(swarm: Swarm) -> Iterator[str]:
    gateway = swarm.gateway
    versions = [("natnet.bitstream", gateway.natnet.bitstream)]
    if gateway.twin is not None:
        versions.append(("twin.version", gateway.twin.version))
    for name, text in versions:
        if text is not None and not OLDEST <= tuple(map(int, text.split("."))) <= NEWEST:
            yield f"gateway.{name} = {text!r}: must be a version of NatNet from 3.0 to 4.5"


@needs("gateway.source", "gateway.replay")
def _replay(swarm: Swarm) -> Iterator[str]:
    if swarm.gateway.source == "replay" and not swarm.gateway.replay.trace:
        yield "gateway.replay.trace = '': gateway.source = 'replay' needs the trace.mcap of an earlier flight"


RULES: tuple[Rule, ...] = (_bodies, _addresses, _twin, _replay)
