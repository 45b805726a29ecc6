"""The rules between a swarm file's keys: each function yields one line per problem, `key = value: rule`.

A rule that uses a wrong key is not applied. Formations, airframes, gateway, addresses and laws have their own rules;
loading.py applies all.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator
from itertools import combinations, pairwise
from math import dist

from flockwire_core.control.graph import LEADER
from flockwire_core.control.plane_polygon import Corner, crossing, edges
from flockwire_core.swarm.laws import BUILT_IN
from flockwire_core.swarm.model import Swarm, uav
from flockwire_core.swarm.wording import beside, meant

Rule = Callable[[Swarm], Iterable[str]]
_NEEDS: dict[Rule, tuple[str, ...]] = {}


def needs(*keys: str) -> Callable[[Rule], Rule]:
    """Name the keys of a rule: it is skipped while one of them is wrong."""

    def named(rule: Rule) -> Rule:
        _NEEDS[rule] = keys
        return rule

    return named


def broken(swarm: Swarm, rules: Iterable[Rule], wrong: set[str]) -> Iterator[str]:
    """Yield the problems that `rules` find, and add them to `wrong`; a rule that uses a `wrong` key is skipped."""
    for rule in rules:
        keys = _NEEDS.get(rule, ("",))
        if any(_within(one, other) for one in keys for other in wrong):
            continue
        for line in rule(swarm):
            yield line
            key = re.match(r"[\w.-]*", line)
            wrong.add(".".join(part for part in (key[0] if key else "").split(".") if not part.isdigit()))


def _within(one: str, other: str) -> bool:
    """Return whether one of two keys equals or contains the other; the empty key is the whole file."""
    return not one or not other or f"{one}.".startswith(f"{other}.") or f"{other}.".startswith(f"{one}.")


@needs("drones.id", "drones.airframe", "drones.host", "airframes", "hosts", "leader.kind")
def _drones(swarm: Swarm) -> Iterator[str]:
    seen: set[int] = set()
    for place, drone in enumerate(swarm.drones):
        if drone.id in seen:
            yield f"drones.{place}.id = {drone.id}: another drone has this id"
        seen.add(drone.id)
        if drone.airframe not in swarm.airframes:
            known = f"[airframes], {sorted(swarm.airframes)}{meant(drone.airframe, swarm.airframes)}"
            yield f"drones.{place}.airframe = {drone.airframe!r}: must be one of {known}"
        if drone.host is not None and drone.host not in swarm.hosts:
            known = f"[hosts], {sorted(swarm.hosts)}{meant(drone.host, swarm.hosts)}"
            yield f"drones.{place}.host = {drone.host!r}: must be one of {known}"
    if not swarm.followers:
        yield "drones: at least one follower (an id above 0) is needed"
    virtual = swarm.leader.kind == "virtual"
    if not virtual and LEADER not in seen:
        yield f"drones: the leader, id 0, is missing (leader.kind = {swarm.leader.kind!r} has its own body)"
    if virtual and LEADER in seen:
        yield "drones: id 0 is the leader, and leader.kind = 'virtual' has no drone"


@needs("gateway.rate_hz", "control.rate_hz")
def _rates(swarm: Swarm) -> Iterator[str]:
    if swarm.gateway.rate_hz < swarm.control.rate_hz:
        yield (
            f"gateway.rate_hz = {swarm.gateway.rate_hz}: must be control.rate_hz = {swarm.control.rate_hz} or more, "
            "because each control step uses a pose"
        )


@needs("control.law")
def _law(swarm: Swarm) -> Iterator[str]:
    law = swarm.control.law
    if law not in BUILT_IN and not re.fullmatch(r"([A-Za-z_][\w.]*|[^:]+\.py):[A-Za-z_]\w*", law):
        yield (
            f"control.law = {law!r}: must be one of {sorted(BUILT_IN)} or your own class, 'file.py:ClassName' or "
            "'package.module:ClassName'"
            f"{meant(law, BUILT_IN)}"
        )


@needs("graph", "drones.id", "leader.kind")
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
            problems.append(f"{key}: this edge appears twice")
        seen.add((source, target))
    yield from problems
    if not problems and (lost := swarm.topology.unreachable()):
        names = ", ".join(map(uav, lost))
        yield f"graph.edges: no spanning tree from the leader: it does not reach {names}"


@needs("avoidance")
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


@needs("limits.fence")
def _fence(swarm: Swarm) -> Iterator[str]:
    fence = swarm.limits.fence
    heights = fence.floor is not None or fence.ceiling is not None
    for axis, low, high in zip("xyz", fence.low, fence.high, strict=True):
        if low >= high:
            key = f"limits.fence.floor = {low}" if axis == "z" and heights else f"limits.fence.min = {list(fence.low)}"
            other = "ceiling" if axis == "z" and heights else "max"
            yield f"{key}: must be below limits.fence.{other}, is not along {axis}"
    if fence.polygon:
        yield from _polygon(fence.polygon)


def _polygon(corners: tuple[Corner, ...]) -> Iterator[str]:
    key = f"limits.fence.polygon = {list(map(list, corners))}"
    if len(corners) < 3:
        yield f"{key}: must have 3 corners or more"
    elif repeated := next((one for one in edges(corners) if one[0] == one[1]), None):
        yield f"{key}: corner {list(repeated[0])} appears twice in a row; remove one"
    elif (found := crossing(corners)) is not None:
        one, other = (f"that from {list(corners[k])} to {list(corners[(k + 1) % len(corners)])}" for k in found)
        yield f"{key}: must not cross or touch itself, {one} meets {other}"


@needs("limits.takeoff_height", "limits.fence", "drones.start", "leader.kind")
def _heights(swarm: Swarm) -> Iterator[str]:
    limits, top = swarm.limits, swarm.limits.fence.high[2]
    flying = [(drone.start[2], place) for place, drone in enumerate(swarm.drones) if drone.id in swarm.flying]
    highest, place = max(flying, default=(0.0, 0))
    if highest + limits.takeoff_height > top:
        yield (
            f"limits.takeoff_height = {limits.takeoff_height}: must be {max(0.0, top - highest):g} m or less: it "
            f"counts from drones.{place}.start, {highest:g} m high, and the fence's top is {top:g} m"
        )


@needs("limits.speed", "limits.vertical_speed")
def _speeds(swarm: Swarm) -> Iterator[str]:
    limits = swarm.limits
    if limits.vertical_speed > limits.speed:
        yield f"limits.vertical_speed = {limits.vertical_speed}: must be limits.speed = {limits.speed} or less"


@needs("control.disturbance", "limits.speed")
def _disturbance(swarm: Swarm) -> Iterator[str]:
    limits, most = swarm.limits, swarm.control.disturbance
    if most >= limits.speed:
        yield f"control.disturbance = {most:g}: must be below limits.speed = {limits.speed:g}"


@needs("limits.battery_land", "limits.battery_takeoff")
def _battery(swarm: Swarm) -> Iterator[str]:
    limits = swarm.limits
    if limits.battery_land > limits.battery_takeoff:
        most = f"limits.battery_takeoff = {limits.battery_takeoff}"
        yield f"limits.battery_land = {limits.battery_land}: must be {most} or less"


@needs("limits.staleness")
def _staleness(swarm: Swarm) -> Iterator[str]:
    stale = swarm.limits.staleness
    ladder = ("pose_zero", "pose_land"), ("estimate_drop", "estimates_hold", "estimates_land")
    pairs = ("nearby_slow", "nearby_hold"), ("command_zero", "command_land"), ("telemetry_warn", "telemetry_land")
    for rungs in (*ladder, *pairs):
        for lower, upper in pairwise(rungs):
            low, high = getattr(stale, lower), getattr(stale, upper)
            if low >= high:
                yield f"limits.staleness.{lower} = {low}: must be below limits.staleness.{upper} = {high}"


@needs("drones.start", "limits.fence", "obstacles", "avoidance")
def _starts(swarm: Swarm) -> Iterator[str]:
    safe = swarm.avoidance
    room = swarm.limits.fence.room()
    for place, drone in enumerate(swarm.drones):
        key = f"drones.{place}.start = {list(drone.start)}"
        if (far := room.outside(drone.start)) > 0.0:
            yield f"{key}: must lie inside limits.fence, is {beside(far, 0.0)} m outside"
        for number, obstacle in enumerate(swarm.obstacles):
            gap = dist(drone.start[:2], obstacle.center[:2]) - obstacle.radius
            if gap < safe.obstacle_safety_distance:
                least = safe.obstacle_safety_distance
                yield f"{key}: {beside(gap, least)} m from obstacle {number}, must be {least} m or more"
    for (i, one), (j, other) in combinations(enumerate(swarm.drones), 2):
        gap = dist(one.start, other.start)
        if gap < safe.drone_safety_distance:
            yield (
                f"drones.{j}.start = {list(other.start)}: {beside(gap, safe.drone_safety_distance)} m from "
                f"drones.{i}.start, must be "
                f"avoidance.drone_safety_distance = {safe.drone_safety_distance} m or more"
            )


RULES: tuple[Rule, ...] = (
    _drones, _law, _graph, _rates, _fence, _heights, _speeds, _disturbance, _battery, _staleness, _avoidance, _starts,
)  # fmt: skip
