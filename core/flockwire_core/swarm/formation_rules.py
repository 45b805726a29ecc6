"""The rules of a swarm file about its formations, which are sampled for them, also around a person who leads."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from itertools import islice, product
from math import ceil, dist, inf, isfinite
from operator import itemgetter

from flockwire_core.control.formation import Formation
from flockwire_core.control.key_frames import KeyFrames
from flockwire_core.domain.vector import Vector, norm
from flockwire_core.swarm.formations import ExpressionFormation, FormationTable
from flockwire_core.swarm.model import DEFAULT_FORMATION, Swarm, uav
from flockwire_core.swarm.rules import Rule
from flockwire_core.swarm.validation import Problem
from flockwire_core.swarm.wording import beside

SURVEY_HORIZON = 120.0  # s of every formation that are sampled, or its length
MOST_SAMPLES = 4000


@dataclass(frozen=True, slots=True)
class Survey:
    """Extremes of a formation over a sampled time span.

    `max_speed` is the largest |h_i'| in m/s, `max_acceleration` the largest |h_i''| in m/s^2, `min_distance` the
    smallest |h_i − h_j| and `min_distance_leader` the smallest |h_i| in m (the former inf for a single follower), `low`
    and `high` the corners of the box of all h_i in m.
    """

    max_speed: float
    max_acceleration: float
    min_distance: float
    min_distance_leader: float
    low: Vector
    high: Vector


def survey_of(swarm: Swarm, name: str = "", duration: float = SURVEY_HORIZON) -> Survey:
    """Return the extremes of the formation called `name` of `swarm`; raises as building it.

    They are those of its first `duration` s, at least SURVEY_HORIZON, or of all its key frames.
    """
    return _survey(swarm.formation_table(name), len(swarm.followers), max(SURVEY_HORIZON, duration))


@lru_cache(maxsize=64)
def _survey(table: FormationTable, count: int, duration: float) -> Survey:
    formation = table.build(count)
    horizon = max(duration, formation.end if isinstance(formation, KeyFrames) else 0.0)
    return survey(formation, horizon, 1 + min(ceil(horizon / 0.3), MOST_SAMPLES))  # s, a step


def survey(formation: Formation, horizon: float, samples: int) -> Survey:
    """Sample a formation at `samples` >= 1 equidistant times from 0 to `horizon` (s) and return its extremes.

    Times between two samples are not checked: choose a period shorter than the loss of a clearance.
    """
    max_speed, max_acceleration, min_distance, min_distance_leader = 0.0, 0.0, inf, inf
    before, step = list[Vector](), horizon / max(samples - 1, 1)
    low, high = (inf, inf, inf), (-inf, -inf, -inf)
    ranks = range(formation.count)
    for k in range(samples):
        t = k * step
        points = [formation.offset(index, t) for index in ranks]
        rates = [formation.offset_rate(index, t) for index in ranks]
        max_speed = max(max_speed, *map(norm, rates))
        max_acceleration = max([max_acceleration, *(dist(*pair) / step for pair in zip(before, rates, strict=False))])
        before = rates
        min_distance = _smallest_distance(points, min_distance)
        min_distance_leader = min(min_distance_leader, *(norm(point) for point in points))
        xs, ys, zs = zip(*points, strict=True)
        low = (min(low[0], *xs), min(low[1], *ys), min(low[2], *zs))
        high = (max(high[0], *xs), max(high[1], *ys), max(high[2], *zs))
    return Survey(max_speed, max_acceleration, min_distance, min_distance_leader, low, high)


def _smallest_distance(points: list[Vector], best: float) -> float:
    """Return the smallest pairwise distance, or `best` if that is smaller: a sweep along the widest axis."""
    low, high = (tuple(map(extreme, zip(*points, strict=True))) for extreme in (min, max))
    axis = max(range(3), key=lambda k: high[k] - low[k])
    swept = sorted(points, key=itemgetter(axis))
    for i, point in enumerate(swept, 1):
        place = point[axis]
        for other in islice(swept, i, None):
            if other[axis] - place >= best:
                break
            if (gap := dist(point, other)) < best:
                best = gap
    return best


def _formations(swarm: Swarm) -> Iterator[Problem]:
    """Yield formations that cannot be flown: no values, speed, fence, spacing."""
    if swarm.formation is None and DEFAULT_FORMATION not in swarm.formations:
        yield Problem("formation", f"missing; there must be one, or a [formations.{DEFAULT_FORMATION}]")
    for name, key in swarm.formation_keys.items():
        table = swarm.formation_table(name)
        if isinstance(table, ExpressionFormation) and (undefined := _undefined(swarm, key, table)):
            yield undefined
            continue
        try:
            shape = survey_of(swarm, name)
        except ValueError as error:
            yield Problem(key, str(error))
            continue
        if table.assignment != "rank" and table.places == "fixed":
            yield Problem(f"{key}.assignment", f"excludes {key}.places = 'fixed'; remove one")
        yield from conflicts(swarm, key, shape)


def conflicts(swarm: Swarm, key: str, shape: Survey) -> Iterator[Problem]:
    """Yield the limits that the formation `key` of this `shape` breaks: speed, fence, spacing."""
    limits, fence = swarm.limits, swarm.limits.fence
    if shape.max_speed > limits.speed:
        fastest = beside(shape.max_speed, limits.speed)
        yield Problem(key, f"its drones fly up to {fastest} m/s, limits.speed = {limits.speed} m/s")
    with_leader = ", with the leader" if swarm.reference.has_body else ""
    for k, axis in enumerate("xyz"):
        low, high, room = shape.low[k], shape.high[k], fence.high[k] - fence.low[k]
        width = max(high, 0.0) - min(low, 0.0) if with_leader else high - low
        if width > room:
            wide = f"is {beside(width, room)} m wide along {axis}{with_leader}"
            yield Problem(key, f"{wide}; limits.fence is {room:.2f} m wide")
    nearest = min(shape.min_distance, shape.min_distance_leader) if swarm.reference.has_body else shape.min_distance
    least = swarm.drone_spacing
    if nearest < least:
        rule = "avoidance.drone_safety_distance" + (" + avoidance.margin" if swarm.control.filtered else "")
        within = f"its drones come within {beside(nearest, least)} m"
        yield Problem(key, f"{within}, must be {least:g} m or more ({rule})")


def _undefined(swarm: Swarm, key: str, table: ExpressionFormation) -> Problem | None:
    """Return the first expression without a finite value."""
    formation = table.build(len(swarm.followers))
    for k, (rank, drone) in product(range(round(10 * SURVEY_HORIZON) + 1), enumerate(swarm.followers)):
        t = k * 0.1  # s, a step
        for axis, place, rate in zip("xyz", formation.offset(rank, t), formation.offset_rate(rank, t), strict=True):
            if not isfinite(place + rate):
                where = f"t = {t:.1f} s for {uav(drone)} (i = {rank})"
                must = f"must have one from 0 to {SURVEY_HORIZON:g} s"
                return Problem(f"{key}.{axis}", f"it or its rate has no finite value at {where}; {must}")
    return None


def _auctions(swarm: Swarm) -> Iterator[Problem]:
    """Yield the formations whose places cannot be shared out over the links between followers."""
    ends = swarm.topology.parted() if swarm.auctioned else None
    if ends is None:
        return
    links = f"the links between followers do not lead from {uav(ends[0])} to {uav(ends[1])}"
    for name, key in swarm.formation_keys.items():
        if name in swarm.auctioned:
            yield Problem(f"{key}.assignment", f"{links}; must lead from each to every other one (graph.edges)")


def _carried(swarm: Swarm) -> Iterator[Problem]:
    """Yield formations and starts that are too close to a person who carries a tracked leader."""
    if swarm.carried and swarm.avoidance.sensing != "nearby":
        yield Problem("avoidance.sensing", "does not sense the person who leads; must be 'nearby'")
    clearance = swarm.person_clearance
    least = (
        f"must be {clearance:g} m or more (gateway.person_radius = {swarm.gateway.person_radius:g}, "
        f"avoidance.obstacle_safety_distance = {swarm.avoidance.obstacle_safety_distance:g})"
    )
    for (place, drone), number in product(enumerate(swarm.drones), swarm.carried):
        person = swarm.drone(number).start
        key, gap = f"drones.{place}.start", dist(drone.start[:2], person[:2])
        if drone.id == number and person[2] <= 0.0:
            rule = "leader.kind = 'tracked' is carried by a person, its height must be above 0: all fly round it"
            yield Problem(key, rule)
        elif drone.id != number and gap < clearance:
            yield Problem(key, f"{beside(gap, clearance)} m from the person who leads, {least}")
    for name, key in swarm.formation_keys.items() if swarm.sole_leader in swarm.carried else ():
        nearest = survey_of(swarm, name).min_distance_leader
        if nearest < clearance:
            yield Problem(
                key, f"its drones come within {beside(nearest, clearance)} m of the person who leads, {least}"
            )


RULES: tuple[Rule, ...] = (_formations,)
LATER: tuple[Rule, ...] = (_auctions, _carried)  # those that need formations
