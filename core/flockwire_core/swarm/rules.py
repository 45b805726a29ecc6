"""The rules between a swarm file's keys: each function yields the problems that it finds.

Formations, ROS 2, addresses, laws and rows of the airframe table have their own rules; loading.py applies all.
"""

from __future__ import annotations

import operator
import re
from collections.abc import Callable, Iterable, Iterator
from itertools import combinations
from math import dist
from operator import attrgetter

from flockwire_core.control.graph import edge_problems
from flockwire_core.control.plane_polygon import Corner, crossing, edges
from flockwire_core.swarm.airframes import AIRFRAMES
from flockwire_core.swarm.laws import BUILT_IN
from flockwire_core.swarm.model import Swarm, uav
from flockwire_core.swarm.tables import Declared
from flockwire_core.swarm.validation import Problem
from flockwire_core.swarm.wording import beside, meant, shown

Rule = Callable[[Swarm], Iterable[Problem]]
BELOW, AT_MOST, ABOVE, AT_LEAST = "below {}", "{} or less", "above {}", "{} or more"
_KEPT = {BELOW: operator.lt, AT_MOST: operator.le, ABOVE: operator.gt, AT_LEAST: operator.ge}
ORDERED = (  # a key, how it compares with another one, and why
    ("gateway.rate_hz", AT_LEAST, "control.rate_hz", ", because each control step uses a pose"),
    ("limits.vertical_speed", AT_MOST, "limits.speed", ""),
    ("control.disturbance", BELOW, "limits.speed", ""),
    ("limits.battery_land", AT_MOST, "limits.battery_takeoff", ""),
    ("limits.staleness.pose_zero", BELOW, "limits.staleness.pose_land", ""),
    ("limits.staleness.estimate_drop", BELOW, "limits.staleness.estimates_hold", ""),
    ("limits.staleness.estimates_hold", BELOW, "limits.staleness.estimates_land", ""),
    ("limits.staleness.nearby_slow", BELOW, "limits.staleness.nearby_hold", ""),
    ("limits.staleness.command_zero", BELOW, "limits.staleness.command_land", ""),
    ("limits.staleness.telemetry_warn", BELOW, "limits.staleness.telemetry_land", ""),
    ("avoidance.drone_influence_radius", ABOVE, "avoidance.drone_safety_distance", ", else avoidance begins too late"),
    ("avoidance.obstacle_influence_radius", ABOVE, "avoidance.obstacle_safety_distance",
     ", else avoidance begins too late"),
    ("avoidance.sensing_radius", AT_LEAST, "avoidance.drone_influence_radius", ""),
    ("avoidance.sensing_radius", AT_LEAST, "avoidance.obstacle_influence_radius", ""),
)  # fmt: skip


def _ordered(swarm: Swarm) -> Iterator[Problem]:
    for key, comparison, other, why in ORDERED:
        value, limit = attrgetter(key, other)(swarm)
        if not _KEPT[comparison](value, limit):
            yield Problem(key, f"must be {comparison.format(f'{other} = {limit}')}{why}")


def _drones(swarm: Swarm) -> Iterator[Problem]:
    ids = [drone.id for drone in swarm.drones]
    for place, drone in enumerate(swarm.drones):
        if drone.id in ids[:place]:
            yield Problem(f"drones.{place}.id", "another drone has this id")
        for key, name, known in (("airframe", drone.airframe, swarm.airframes), ("host", drone.host, swarm.hosts)):
            if name is not None and name not in known:
                yield Problem(f"drones.{place}.{key}", f"must be one of [{key}s], {sorted(known)}{meant(name, known)}")


def _members(swarm: Swarm) -> Iterator[Problem]:
    if not swarm.hosts:
        yield Problem("hosts", "at least one host is needed (without the table there is one called local)")
    if not swarm.followers:
        yield Problem("drones", "at least one follower (an id that is not in leaders) is needed")
    for number, leader in swarm.leading.items():
        if leader.has_body and number not in swarm.tracked:
            kind = f"leader.kind = {leader.kind!r} has its own body"
            yield Problem("drones", f"the leader, id {number}, is missing ({kind})")
        if not leader.has_body and number in swarm.tracked:
            yield Problem("drones", f"id {number} is a leader, and leader.kind = 'virtual' has no drone")


def _leaders(swarm: Swarm) -> Iterator[Problem]:
    for place, number in enumerate(swarm.leaders):
        if number in swarm.leaders[:place]:
            yield Problem(f"leaders.{place}", "this leader appears twice")
    for number in swarm.leader.own:
        if number not in swarm.leaders:
            yield Problem(
                f"leader.{number}", f"leaders = {list(swarm.leaders)} has no {number}; add it, or remove the table"
            )


def _law(swarm: Swarm) -> Iterator[Problem]:
    law = swarm.control.law
    if swarm.control.elsewhere:
        port = law.removeprefix("tcp:")
        if not law.startswith("socket:") and not (port.isdecimal() and 0 < int(port) < 65536):
            yield Problem("control.law", "must be tcp:PORT, a port from 1 to 65535 of this machine")
        elif law == "socket:":
            yield Problem("control.law", "must be socket:PATH, the path of a Unix socket")
        return
    if swarm.control.information != Declared():
        rule = "is of laws in another process alone; a class declares its own"
        yield Problem("control.information", f"{rule}: remove the table", "")
    if law not in BUILT_IN and not re.fullmatch(r"([A-Za-z_][\w.]*|[^:]+\.py):[A-Za-z_]\w*", law):
        own = "your own class, 'file.py:ClassName' or 'package.module:ClassName'"
        yield Problem("control.law", f"must be one of {sorted(BUILT_IN)} or {own}{meant(law, BUILT_IN)}")


def _pace(swarm: Swarm) -> Iterator[Problem]:
    information = swarm.control.information
    if information.pace != "step" and not information.message:
        yield Problem("control.information.message", f"must be above 0 with pace = {information.pace!r}")


def _graph(swarm: Swarm) -> Iterator[Problem]:
    links = swarm.graph.edges
    broken = edge_problems(swarm.followers, swarm.leaders, links)
    problems = [Problem(f"graph.edges.{place}", rule, shown(links[place][:2])) for place, rule in broken]
    yield from problems
    if swarm.leaders and not problems and (lost := swarm.topology.unreachable()):
        names = ", ".join(map(uav, lost))
        yield Problem("graph.edges", f"no spanning tree from a leader: none reaches {names}; add edges [from, to]", "")


def _fence(swarm: Swarm) -> Iterator[Problem]:
    fence = swarm.limits.fence
    for axis, low, high in zip("xyz", fence.low, fence.high, strict=True):
        heights = axis == "z" and (fence.floor is not None or fence.ceiling is not None)
        lower, upper, value = ("floor", "ceiling", low) if heights else ("min", "max", fence.low)
        if low >= high:
            rule = f"must be below limits.fence.{upper}, is not along {axis}"
            yield Problem(f"limits.fence.{lower}", rule, shown(value))
    if fence.polygon:
        yield from (Problem("limits.fence.polygon", rule) for rule in _polygon(fence.polygon))


def _polygon(corners: tuple[Corner, ...]) -> Iterator[str]:
    if len(corners) < 3:
        yield "must have 3 corners or more"
    elif repeated := next((one for one in edges(corners) if one[0] == one[1]), None):
        yield f"corner {list(repeated[0])} appears twice in a row; remove one"
    elif (found := crossing(corners)) is not None:
        one, other = (f"that from {list(corners[k])} to {list(corners[(k + 1) % len(corners)])}" for k in found)
        yield f"must not cross or touch itself, {one} meets {other}"


def _heights(swarm: Swarm) -> Iterator[Problem]:
    limits, top = swarm.limits, swarm.limits.fence.high[2]
    flying = [(drone.start[2], place) for place, drone in enumerate(swarm.drones) if drone.id in swarm.flying]
    highest, place = max(flying, default=(0.0, 0))
    if highest + limits.takeoff_height > top:
        start = f"drones.{place}.start, {highest:g} m high, and the fence's top is {top:g} m"
        yield Problem("limits.takeoff_height", f"must be {max(0.0, top - highest):g} m or less: it counts from {start}")


def _starts(swarm: Swarm) -> Iterator[Problem]:
    safe, room = swarm.avoidance.safe, swarm.limits.fence.room()
    for place, drone in enumerate(swarm.drones):
        key = f"drones.{place}.start"
        if (far := room.outside(drone.start)) > 0.0:
            yield Problem(key, f"must lie inside limits.fence, is {beside(far, 0.0)} m outside")
        for number, obstacle in enumerate(swarm.obstacles):
            gap = dist(drone.start[:2], obstacle.center[:2]) - obstacle.radius
            if gap < (least := safe.obstacle):
                yield Problem(key, f"{beside(gap, least)} m from obstacle {number}, must be {least} m or more")
    for (i, one), (j, other) in combinations(enumerate(swarm.drones), 2):
        gap = dist(one.start, other.start)
        if gap < (least := safe.drone):
            must = f"must be avoidance.drone_safety_distance = {least} m or more"
            yield Problem(f"drones.{j}.start", f"{beside(gap, least)} m from drones.{i}.start, {must}")


def _kinds(swarm: Swarm) -> Iterator[Problem]:
    """Yield tables of drones with another kind."""
    for place, drone in enumerate(swarm.drones):
        frame = swarm.airframes[drone.airframe]
        for row in AIRFRAMES:
            if frame.kind != row.kind and getattr(drone, row.kind, None) is not None:
                which = f"airframe {drone.airframe!r} is of kind {frame.kind!r}"
                yield Problem(f"drones.{place}.{row.kind}", f"{which}, must be {row.kind!r}")


def _cameras(swarm: Swarm) -> Iterator[Problem]:
    """Yield real drones that simulated cameras do not see."""
    for place, drone in enumerate(swarm.drones if swarm.gateway.source == "simulated" else ()):
        if drone.id in swarm.flying and swarm.real_address(drone.id) is not None:
            yield Problem(
                f"drones.{place}.{swarm.row(drone.id).kind}.address",
                f"no tracker sees {uav(drone.id)}, gateway.source = 'simulated'; set a real tracker, or remove the "
                "address to simulate the drone",
            )


def _reactions(swarm: Swarm) -> Iterator[Problem]:
    """Yield limits of the staleness ladder that are slower than an airframe's own reaction."""
    for name in dict.fromkeys(swarm.drone(number).airframe for number in swarm.flying):
        row = swarm.airframe_row(name)
        for key, lost, by_itself in (
            ("command_land", "setpoints", row.without_setpoints),
            ("pose_land", "poses", row.without_poses),
            ("telemetry_land", "its link", row.without_link),
        ):
            if getattr(swarm.limits.staleness, key) >= by_itself.after:
                when = f"{by_itself.after:g} s, after which airframe {name!r} {by_itself.does} by itself without {lost}"
                yield Problem(f"limits.staleness.{key}", f"must be below {when}")


def _bodies(swarm: Swarm) -> Iterator[Problem]:
    owners: dict[str | int, int] = {}
    for place, drone in enumerate(swarm.drones):
        key, body = f"drones.{place}.body", swarm.body(drone.id)
        if isinstance(body, int) and swarm.gateway.source != "natnet":
            yield Problem(key, "only gateway.source = 'natnet' numbers bodies; must be a name")
        if body in owners:
            yield Problem(key, f"drone {owners[body]} has this body", repr(body))
        owners[body] = drone.id
    for place, obstacle in enumerate(swarm.tracked_obstacles):
        key = f"tracked_obstacles.{place}.body"
        if obstacle.body in owners:
            yield Problem(key, f"drone {owners[obstacle.body]} has this body")
        if swarm.avoidance.sensing != "nearby":
            yield Problem(key, f"avoidance.sensing = {swarm.avoidance.sensing!r} does not sense it; must be 'nearby'")


def _replay(swarm: Swarm) -> Iterator[Problem]:
    if swarm.gateway.source == "replay" and not swarm.gateway.replay.trace:
        yield Problem("gateway.replay.trace", "gateway.source = 'replay' needs the trace.mcap of an earlier flight")


TABLES: tuple[Rule, ...] = (_leaders, _drones, _members, _law, _pace, _fence, _ordered)  # those of single tables
RULES: tuple[Rule, ...] = (_graph, _heights, _starts, _kinds, _cameras, _reactions, _bodies, _replay)
