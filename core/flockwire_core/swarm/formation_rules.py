"""The rules of a swarm file about its formations, also around a person who leads."""

from __future__ import annotations

from collections.abc import Iterator
from math import dist

from flockwire_core.control.graph import LEADER
from flockwire_core.control.survey import Survey
from flockwire_core.swarm.formations import ExpressionFormation
from flockwire_core.swarm.model import DEFAULT_FORMATION, SURVEY_HORIZON, Swarm, uav
from flockwire_core.swarm.rules import Rule, needs
from flockwire_core.swarm.wording import beside

UNDEFINED_STEP = 0.1  # s between the times at which expressions must have values


@needs("formation", "formations", "drones.id", "leader.kind", "limits", "avoidance")
def _formations(swarm: Swarm) -> Iterator[str]:
    """Yield formations that cannot be flown: no values, speed, fence, spacing."""
    if swarm.formation is None and DEFAULT_FORMATION not in swarm.formations:
        yield f"formation: missing; there must be one, or a [formations.{DEFAULT_FORMATION}]"
        return
    for name in swarm.formations if swarm.formation is None else swarm.formation_names:
        yield from _formation(swarm, name)


def _formation(swarm: Swarm, name: str) -> Iterator[str]:
    key = f"formations.{name}" if name else "formation"
    if undefined := list(_undefined(swarm, key, swarm.formation_table(name))):
        yield from undefined
        return
    try:
        shape = swarm.survey(name)
    except ValueError as error:
        yield f"{key}: {error}"
        return
    table = swarm.formation_table(name)
    if table.assignment != "rank" and table.places == "fixed":
        yield f"{key}.assignment = {table.assignment!r}: excludes {key}.places = 'fixed'; remove one"
    yield from conflicts(swarm, key, shape)


def conflicts(swarm: Swarm, key: str, shape: Survey) -> Iterator[str]:
    """Yield the limits that the formation `key` of this `shape` breaks: speed, fence, spacing."""
    limits, fence = swarm.limits, swarm.limits.fence
    if shape.max_speed > limits.speed:
        fastest = beside(shape.max_speed, limits.speed)
        yield f"{key}: its drones fly up to {fastest} m/s, limits.speed = {limits.speed} m/s"
    with_leader = ", with the leader" if swarm.leader.has_body else ""
    for k, axis in enumerate("xyz"):
        low, high, room = shape.low[k], shape.high[k], fence.high[k] - fence.low[k]
        width = max(high, 0.0) - min(low, 0.0) if with_leader else high - low
        if width > room:
            wide = f"is {beside(width, room)} m wide along {axis}{with_leader}"
            yield f"{key}: {wide}; limits.fence is {room:.2f} m wide"
    nearest = min(shape.min_distance, shape.min_distance_leader) if swarm.leader.has_body else shape.min_distance
    least = swarm.drone_spacing
    if nearest < least:
        margin = " + avoidance.margin" if swarm.control.filtered else ""
        yield (
            f"{key}: its drones come within {beside(nearest, least)} m, must be {least:g} m or more "
            f"(avoidance.drone_safety_distance{margin})"
        )


def _undefined(swarm: Swarm, key: str, table: object) -> Iterator[str]:
    if not isinstance(table, ExpressionFormation):
        return
    found = table.undefined(len(swarm.followers), SURVEY_HORIZON, UNDEFINED_STEP)
    if found is not None:
        axis, rank, t = found
        drone = uav(swarm.followers[rank])
        yield (
            f"{key}.{axis} = {getattr(table, axis)!r}: it or its rate has no finite value at t = {t:.1f} s for {drone} "
            f"(i = {rank}); must have one from 0 to {SURVEY_HORIZON:g} s"
        )


@needs("formation", "formations", "drones.id", "graph")
def _auctions(swarm: Swarm) -> Iterator[str]:
    """Yield the formations whose places cannot be shared out over the links between followers."""
    ends = swarm.topology.parted() if swarm.auctioned else None
    if ends is None:
        return
    for name in sorted(swarm.auctioned):
        key = f"formations.{name}" if name else "formation"
        yield (
            f"{key}.assignment = 'auction': the links between followers do not lead from {uav(ends[0])} to "
            f"{uav(ends[1])}; must lead from each to every other one (graph.edges)"
        )


@needs("drones", "leader.kind", "avoidance", "gateway.person_radius", "formation", "formations")
def _carried(swarm: Swarm) -> Iterator[str]:
    """Yield formations and starts that are too close to the person who carries a tracked leader."""
    if swarm.leader.kind != "tracked":
        return
    if swarm.avoidance.sensing != "nearby":
        yield f"avoidance.sensing = {swarm.avoidance.sensing!r}: does not sense the person who leads; must be 'nearby'"
    person, clearance = swarm.drone(LEADER).start, swarm.person_clearance
    least = (
        f"must be {clearance:g} m or more (gateway.person_radius = {swarm.gateway.person_radius:g}, "
        f"avoidance.obstacle_safety_distance = {swarm.avoidance.obstacle_safety_distance:g})"
    )
    for place, drone in enumerate(swarm.drones):
        key, gap = f"drones.{place}.start = {list(drone.start)}", dist(drone.start[:2], person[:2])
        if drone.id == LEADER and person[2] <= 0.0:
            yield f"{key}: leader.kind = 'tracked' is carried by a person, its height must be above 0: all fly round it"
        elif drone.id != LEADER and gap < clearance:
            yield f"{key}: {beside(gap, clearance)} m from the person who leads, {least}"
    for name in swarm.formations if swarm.formation is None else swarm.formation_names:
        nearest = swarm.survey(name).min_distance_leader
        if nearest < clearance:
            key = f"formations.{name}" if name else "formation"
            yield f"{key}: its drones come within {beside(nearest, clearance)} m of the person who leads, {least}"


RULES: tuple[Rule, ...] = (_formations, _auctions, _carried)
