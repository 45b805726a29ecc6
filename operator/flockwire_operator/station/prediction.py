"""Predicts problems of a flight: the leader's course and the formation around it, second by second."""

from __future__ import annotations

from collections.abc import Iterator
from math import dist, hypot

from flockwire_core.control.trajectory import Trajectory
from flockwire_core.domain.vector import ZERO, Vector, add, norm
from flockwire_core.swarm.formation_rules import SURVEY_HORIZON, conflicts, survey_of
from flockwire_core.swarm.leader import AT_REST
from flockwire_core.swarm.model import Swarm, uav
from flockwire_core.swarm.trajectories import course_of, speed_of, trajectory_of


def predicted(swarm: Swarm, duration: float, avoided: bool = True) -> Iterator[str]:
    """Yield the problems in `duration` s of each formation, if every drone is exactly at its place.

    0 is a flight without an end. With `avoided` obstacles are problems that followers fly around.
    """
    endless = 3600.0  # s of a flight without an end that are evaluated
    climb = swarm.limits.takeoff_height / swarm.limits.vertical_speed
    if 0.0 < duration < climb:
        yield (
            f"--duration = {duration:g} s: the take-off alone takes {climb:.0f} s (limits.takeoff_height = "
            f"{swarm.limits.takeoff_height:g} m, limits.vertical_speed = {swarm.limits.vertical_speed:g} m/s)"
        )
    duration = duration or endless
    yield from _of_real_drones(swarm)
    yield from _of_leader(swarm, duration)
    for name, key in swarm.formation_keys.items():
        yield from _of_followers(swarm, name, duration, avoided)
        if duration > SURVEY_HORIZON:  # the rules have looked at what comes before it
            yield from map(str, conflicts(swarm, key, survey_of(swarm, name, duration)))


def _of_real_drones(swarm: Swarm) -> Iterator[str]:
    """Yield what real drones fly without, though the room has people and walls."""
    real = [number for number in swarm.flying if number not in swarm.simulated]
    if not real:
        return
    limits, names = swarm.limits, ", ".join(map(uav, real))
    if not limits.fence.model_fields_set & {"min", "max", "polygon"}:
        size = " x ".join(f"{high - low:g}" for low, high in zip(limits.fence.low, limits.fence.high, strict=True))
        yield f"limits.fence is the default, {size} m, for real drones ({names}): set it to the room of the flight"
    if not swarm.control.filtered:
        yield f"control.safety_filter: real drones ({names}) fly without it: nothing keeps their distances or the fence"


def _of_leader(swarm: Swarm, duration: float) -> Iterator[str]:
    for number in swarm.walking:
        leader = swarm.leading[number]
        if (walks := trajectory_of(leader).fastest) > leader.speed:
            yield f"the simulated person walks {walks:.2f} m/s, leader.speed = {leader.speed:g} m/s"
    for number in swarm.leading:
        if number in swarm.flying:
            yield from _of_course(swarm, number, duration)


def _of_course(swarm: Swarm, number: int, duration: float) -> Iterator[str]:
    fastest, name = speed_of(swarm.leading[number]), "the leader" if swarm.sole_leader is not None else uav(number)
    if fastest > swarm.limits.speed:
        yield f"{name}'s course takes {fastest:.2f} m/s, limits.speed = {swarm.limits.speed:g} m/s"
    room, (start, trajectory) = swarm.limits.fence.room(), _motion(swarm, number)
    places = [(t, add(start, trajectory.position(t))) for t in _instants(duration)]
    if outside := next(((t, place) for t, place in places if room.outside(place) > 0.0), None):
        yield f"{name}'s course leaves limits.fence after {outside[0]:.1f} s, at {_shown(outside[1])}"
    if close := next(((t, number) for t, place in places for number in _too_near(swarm, place)), None):
        safe = swarm.avoidance.obstacle_safety_distance
        yield f"{name}'s course comes closer than {safe:g} m to obstacle {close[1]} after {close[0]:.1f} s"


def _of_followers(swarm: Swarm, name: str, duration: float, avoided: bool) -> Iterator[str]:
    key, limits = swarm.formation_keys[name], swarm.limits
    formation, room = swarm.build_formation(name), limits.fence.room()
    start, trajectory = _motion(swarm, swarm.sole_leader)
    fastest, outside = (0.0, 0), None
    blocked: dict[int, tuple[float, int]] = {}  # when first, and by which obstacle, by place
    for t in _instants(duration):
        leader, rate = add(start, trajectory.position(t)), trajectory.rate(t)
        for rank in range(len(swarm.followers)):
            place = add(leader, formation.offset(rank, t))
            fastest = max(fastest, (norm(add(rate, formation.offset_rate(rank, t))), rank))
            if outside is None and room.outside(place) > 0.0:
                outside = t, rank, place
            for obstacle in _too_near(swarm, place):
                blocked.setdefault(rank, (t, obstacle))
    speed, rank = fastest
    if speed > limits.speed:
        who = _owner(swarm, name, rank)
        yield f"{key}: with the leader's speed {who} needs {speed:.2f} m/s, limits.speed = {limits.speed:g} m/s"
    if outside is not None:
        t, rank, place = outside
        yield f"{key}: the place of {_owner(swarm, name, rank)} leaves limits.fence after {t:.1f} s, at {_shown(place)}"
    if blocked and avoided:
        rank, (t, obstacle) = next(iter(blocked.items()))  # the earliest
        yield (
            f"{key}: obstacle {obstacle} is at the place of {_owner(swarm, name, rank)} after {t:.1f} s; it must avoid "
            f"it, as {len(blocked)} of {len(swarm.followers)} followers must"
        )


def _owner(swarm: Swarm, formation: str, rank: int) -> str:
    """Return who has the place `rank`; with an auction nobody knows before the flight."""
    return f"whoever gets place {rank}" if formation in swarm.auctioned else uav(swarm.followers[rank])


def _instants(duration: float) -> Iterator[float]:
    instants = 2400  # largest number of instants: a long flight has longer steps
    step = max(0.05, duration / instants)
    return (k * step for k in range(int(duration / step) + 1))


def _motion(swarm: Swarm, number: int | None) -> tuple[Vector, Trajectory]:
    """Return where a leader begins a formation, m, and its known trajectory; without one, the origin at rest."""
    if number is None:
        return ZERO, course_of(AT_REST)
    leader = swarm.leading[number]
    start = swarm.drone(number).start if leader.has_body else leader.start
    if number in swarm.flying:
        start = add(start, (0.0, 0.0, swarm.limits.takeoff_height))
    return start, trajectory_of(leader) if number in swarm.walking else course_of(leader)


def _too_near(swarm: Swarm, place: Vector) -> Iterator[int]:
    """Yield the obstacles whose surface is nearer to a place than a drone may be."""
    for number, obstacle in enumerate(swarm.obstacles):
        gap = dist(place[:2], obstacle.center[:2]) - obstacle.radius
        above = place[2] - obstacle.height if obstacle.height is not None else 0.0
        if (hypot(max(gap, 0.0), above) if above > 0.0 else gap) < swarm.avoidance.obstacle_safety_distance:
            yield number


def _shown(place: Vector) -> str:
    return f"[{', '.join(f'{x:.1f}' for x in place)}]"
