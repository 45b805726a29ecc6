"""The rules that tie a swarm file's keys together: each function yields one line per problem, `key = value: rule`."""

from __future__ import annotations

import ipaddress
import re
from collections.abc import Iterator
from itertools import combinations, pairwise
from math import dist, isinf

from flockwire.control.graph import LEADER
from flockwire.swarm.model import Swarm, uav

BUILT_IN = {
    "paper": "flockwire_agent.paper_law:PaperLaw",
    "extended": "flockwire_agent.extended_law:ExtendedLaw",
}


def basic_problems(swarm: Swarm) -> Iterator[str]:
    """Yield what is wrong with drones and hosts; no other rule can be looked at before these are sound."""
    yield from _drones(swarm)
    yield from _hosts(swarm)


def problems(swarm: Swarm) -> Iterator[str]:
    """Yield what is wrong with all that must be sound before places and formations can be looked at."""
    for rule in (_law, _graph, _rates, _limits, _avoidance, _fence):
        yield from rule(swarm)


def place_problems(swarm: Swarm) -> Iterator[str]:
    """Yield what is wrong with starts and formations."""
    yield from _starts(swarm)
    yield from _formations(swarm)


def _drones(swarm: Swarm) -> Iterator[str]:
    seen: set[int] = set()
    for place, drone in enumerate(swarm.drones):
        if drone.id in seen:
            yield f"drones.{place}.id = {drone.id}: another drone has this id"
        seen.add(drone.id)
        if drone.airframe not in swarm.airframes:
            yield f"drones.{place}.airframe = {drone.airframe!r}: must be one of [airframes], {sorted(swarm.airframes)}"
        if drone.host is not None and drone.host not in swarm.hosts:
            yield f"drones.{place}.host = {drone.host!r}: must be one of [hosts], {sorted(swarm.hosts)}"
    if not swarm.followers:
        yield "drones: at least one follower (an id above 0) is needed"
    virtual = swarm.leader.kind == "virtual"
    if not virtual and LEADER not in seen:
        yield f"drones: the leader, id 0, is missing (leader.kind = {swarm.leader.kind!r} flies a drone of its own)"
    if virtual and LEADER in seen:
        yield "drones: id 0 is the leader, and leader.kind = 'virtual' has no drone"


def _hosts(swarm: Swarm) -> Iterator[str]:
    if not swarm.hosts:
        yield "hosts = {}: at least one host is needed (leave the table out for one called local)"
    for name, host in swarm.hosts.items():
        if not re.fullmatch(r"[A-Za-z0-9]([A-Za-z0-9-]{0,61}[A-Za-z0-9])?", name):
            yield f"hosts.{name}: must be a host name: letters, digits and hyphens, at most 63"
        yield from _ip(f"hosts.{name}.address", host.address)
    for place, drone in enumerate(swarm.drones):
        yield from _address(f"drones.{place}.address", drone.address)


def _address(key: str, address: str | None) -> Iterator[str]:
    if address is None:
        return
    split = re.fullmatch(r"(?:\[(?P<v6>[^]]+)\]|(?P<v4>[^:]+)):(?P<port>[0-9]{4,5})", address)
    if split is None or not 1024 <= int(split["port"]) <= 65535:
        yield f"{key} = {address!r}: must be IP:PORT, PORT from 1024 to 65535 (IPv6: [IP]:PORT)"
        return
    yield from _ip(key, split["v6"] or split["v4"])


def _ip(key: str, text: str) -> Iterator[str]:
    try:
        ipaddress.ip_address(text)
    except ValueError:
        yield f"{key} = {text!r}: must be an IP address"


def _rates(swarm: Swarm) -> Iterator[str]:
    if swarm.gateway.rate_hz < swarm.control.rate_hz:
        yield (
            f"gateway.rate_hz = {swarm.gateway.rate_hz}: must be control.rate_hz = {swarm.control.rate_hz} or more, "
            "each control step answers a pose"
        )


def _law(swarm: Swarm) -> Iterator[str]:
    law = swarm.control.law
    if law not in BUILT_IN and not re.fullmatch(r"[A-Za-z_][\w.]*:[A-Za-z_]\w*", law):
        yield f"control.law = {law!r}: must be one of {sorted(BUILT_IN)} or your own class, 'package.module:ClassName'"


def _graph(swarm: Swarm) -> Iterator[str]:
    known = {LEADER, *swarm.followers}
    seen: set[tuple[int, int]] = set()
    problems = []
    for place, edge in enumerate(swarm.graph.edges):
        source, target = edge[0], edge[1]
        key = f"graph.edges.{place} = [{source}, {target}]"
        problems += [f"{key}: there is no drone {end}" for end in (source, target) if end not in known]
        if target == LEADER:
            problems.append(f"{key}: the leader has no in-neighbours")
        if source == target:
            problems.append(f"{key}: a drone is not its own neighbour")
        if (source, target) in seen:
            problems.append(f"{key}: this edge is there twice")
        seen.add((source, target))
    yield from problems
    if not problems and (lost := swarm.topology.unreachable()):
        names = ", ".join(map(uav, lost))
        yield f"graph.edges: no spanning tree from the leader: it does not reach {names}"


def _avoidance(swarm: Swarm) -> Iterator[str]:
    table = swarm.avoidance
    for kind in ("drone", "obstacle"):
        influence: float = getattr(table, f"{kind}_influence_radius")
        safety: float = getattr(table, f"{kind}_safety_distance")
        if influence <= safety:
            yield (
                f"avoidance.{kind}_influence_radius = {influence}: must be above "
                f"avoidance.{kind}_safety_distance = {safety}, else avoidance begins too late"
            )
        if table.sensing_radius < influence:
            yield (
                f"avoidance.sensing_radius = {table.sensing_radius}: must reach at least "
                f"avoidance.{kind}_influence_radius = {influence}"
            )


def _fence(swarm: Swarm) -> Iterator[str]:
    fence = swarm.limits.fence
    for axis, low, high in zip("xyz", fence.min, fence.max, strict=True):
        if low >= high:
            yield f"limits.fence.min = {list(fence.min)}: must be below limits.fence.max, is not along {axis}"


def _limits(swarm: Swarm) -> Iterator[str]:
    limits, stale = swarm.limits, swarm.limits.staleness
    top = limits.fence.max[2]
    if limits.takeoff_height > top:
        yield f"limits.takeoff_height = {limits.takeoff_height}: must be below the fence's top, {top} m"
    if limits.vertical_speed > limits.speed:
        yield f"limits.vertical_speed = {limits.vertical_speed}: must be limits.speed = {limits.speed} or less"
    if limits.battery_land > limits.battery_takeoff:
        most = f"limits.battery_takeoff = {limits.battery_takeoff}"
        yield f"limits.battery_land = {limits.battery_land}: must be {most} or less"
    ladder = ("pose_zero", "pose_land"), ("estimate_drop", "estimates_hold", "estimates_land")
    pairs = ("nearby_slow", "nearby_hold"), ("command_zero", "command_land"), ("telemetry_warn", "telemetry_land")
    for rungs in (*ladder, *pairs):
        for lower, upper in pairwise(rungs):
            low, high = getattr(stale, lower), getattr(stale, upper)
            if low >= high:
                yield f"limits.staleness.{lower} = {low}: must be below limits.staleness.{upper} = {high}"


def _starts(swarm: Swarm) -> Iterator[str]:
    safe = swarm.avoidance
    fence = swarm.limits.fence
    for place, drone in enumerate(swarm.drones):
        key = f"drones.{place}.start = {list(drone.start)}"
        if any(not low <= x <= high for low, x, high in zip(fence.min, drone.start, fence.max, strict=True)):
            yield f"{key}: must lie inside limits.fence"
        for number, obstacle in enumerate(swarm.obstacles):
            gap = dist(drone.start[:2], obstacle.center[:2]) - obstacle.radius
            if gap < safe.obstacle_safety_distance:
                yield f"{key}: {gap:.2f} m from obstacle {number}, must be {safe.obstacle_safety_distance} m or more"
    for (i, one), (j, other) in combinations(enumerate(swarm.drones), 2):
        gap = dist(one.start, other.start)
        if gap < safe.drone_safety_distance:
            yield (
                f"drones.{j}.start = {list(other.start)}: {gap:.2f} m from drones.{i}.start, must be "
                f"avoidance.drone_safety_distance = {safe.drone_safety_distance} m or more"
            )


def _formations(swarm: Swarm) -> Iterator[str]:
    for name in ("", *swarm.formations):
        yield from _formation(swarm, name)


def _formation(swarm: Swarm, name: str) -> Iterator[str]:
    key = f"formations.{name}" if name else "formation"
    try:
        shape = swarm.survey(name)
    except ValueError as error:
        yield f"{key}: {error}"
        return
    safe = swarm.avoidance.drone_safety_distance
    if shape.max_speed > swarm.limits.speed:
        yield f"{key}: its drones fly up to {shape.max_speed:.2f} m/s, limits.speed = {swarm.limits.speed} m/s"
    for axis, low, high, reach in zip("xyz", swarm.limits.fence.min, swarm.limits.fence.max, shape.extent, strict=True):
        if 2.0 * reach > high - low:
            yield f"{key}: reaches {reach:.2f} m from the leader along {axis}, limits.fence is {high - low:.2f} m wide"
    nearest = (
        shape.min_distance if swarm.leader.kind == "virtual" else min(shape.min_distance, shape.min_distance_leader)
    )
    if nearest < safe and not isinf(nearest):
        yield f"{key}: its drones come within {nearest:.2f} m, avoidance.drone_safety_distance = {safe} m"
