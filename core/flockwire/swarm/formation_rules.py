"""The rules of a swarm file about its formations, also around a person who leads."""

from __future__ import annotations

from collections.abc import Iterator
from math import dist, isinf

from flockwire.control.graph import LEADER
from flockwire.swarm.formations import ExpressionFormation
from flockwire.swarm.model import DEFAULT_FORMATION, SURVEY_HORIZON, Swarm, uav
from flockwire.swarm.rules import Rule, needs

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
    table, safe = swarm.formation_table(name), swarm.avoidance.drone_safety_distance
    if table.assignment != "rank" and table.places == "fixed":
        yield f"{key}.assignment = {table.assignment!r}: excludes {key}.places = 'fixed'; remove one"
    if shape.max_speed > swarm.limits.speed:
        yield f"{key}: its drones fly up to {shape.max_speed:.2f} m/s, limits.speed = {swarm.limits.speed} m/s"
    fence = swarm.limits.fence
    for axis, low, high, reach in zip("xyz", fence.low, fence.high, shape.extent, strict=True):
        if 2.0 * reach > high - low:
            yield f"{key}: reaches {reach:.2f} m from the leader along {axis}, limits.fence is {high - low:.2f} m wide"
    nearest = (
        shape.min_distance if swarm.leader.kind == "virtual" else min(shape.min_distance, shape.min_distance_leader)
    )
    if nearest < safe and not isinf(nearest):
        yield f"{key}: its drones come within {nearest:.2f} m, avoidance.drone_safety_distance = {safe} m"


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
            yield f"{key}: {gap:.2f} m from the person who leads, {least}"
    for name in swarm.formations if swarm.formation is None else swarm.formation_names:
        nearest = swarm.survey(name).min_distance_leader
        if nearest < clearance:
            key = f"formations.{name}" if name else "formation"
            yield f"{key}: its drones come within {nearest:.2f} m of the person who leads, {least}"


RULES: tuple[Rule, ...] = (_formations, _auctions, _carried)
