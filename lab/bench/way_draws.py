"""Flights in which something is in the way, drawn by family and number, for ways.py."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from math import cos, dist, hypot, inf, pi, sin, sqrt
from random import Random

from flockwire_core.control.formation import Circle, Formation, grid, line
from flockwire_core.control.trajectory import Waypoints
from settling import AREA, SPACING, TELLO, Table, merged

Point = tuple[float, float]

KEPT = 0.33  # m from an obstacle's surface: the default safety distance and margin
FIRST = 3.0  # s of the formation from which places pass obstacles
LAST = 36.0  # s from take-off
LEADER_ROOM = 0.7  # m from the leader's path to an obstacle's surface: its detours are test_leader_path.py's


@dataclass(frozen=True)
class Flight:
    """A flight to judge: its swarm, s from take-off to landing, faults, and the figures that its family needs."""

    table: Table
    duration: float
    faults: list[Table] = field(default_factory=list)
    detour: float = 0.0  # m, the worst deviation of the shortest detour
    forbidden: float = 0.0  # s that the place is forbidden
    way: float = 0.0  # m, the longest way from a start to its place


def issue(number: int, airframe: Table) -> Flight:
    """Nine drones in a grid behind a leader at 0.2 m/s, obstacles of 0.25 and 0.4 m where places pass, 30 s."""
    chance = Random(f"issue {number}")
    obstacles = [((2.6, 1.0), 0.25), ((4.0, -1.0), 0.4)]
    return _obstructed(chance, 8, {"kind": "grid"}, obstacles, _straight(0.2), merged(TELLO, airframe), 30.0)


def obstacles(number: int, airframe: Table) -> Flight:
    """5, 9 or 12 followers in a circle, a grid or a line, 2 to 4 obstacles, a leader straight on or in a circle."""
    chance = Random(f"obstacles {number}")
    followers = chance.choice((5, 9, 12))
    formation = chance.choice(
        (
            {"kind": "circle", "radius": 0.25 * followers * 0.8, "rate": 0.05},
            {"kind": "grid"},
            {"kind": "line", "spacing": 0.8},
        )
    )
    straight = chance.random() < 0.5
    path = _straight(chance.uniform(0.1, 0.3)) if straight else _circle(1.5, chance.uniform(0.08, 0.2))
    count, found = chance.randint(2, 4), list[tuple[Point, float]]()
    while len(found) < count:
        radius = chance.uniform(0.1, 0.5)
        center = (chance.uniform(-2.0, 5.5), chance.uniform(-3.0, 3.0))
        gap = min((dist(center, other) - r - radius for other, r in found), default=9.0)
        if gap > 0.1 and path[1](center) > radius + LEADER_ROOM:
            found.append((center, radius))
    return _obstructed(chance, followers, formation, found, path, airframe, 45.0)


def crossing(number: int, airframe: Table) -> Flight:
    """One follower, whose place crosses an obstacle of 0.1 to 0.6 m at 0.1 to 0.5 m/s, head on to grazing."""
    chance = Random(f"crossing {number}")
    radius, speed = chance.uniform(0.1, 0.6), chance.uniform(0.1, 0.5)
    kept = radius + KEPT
    aside = chance.choice((0.0, chance.uniform(-0.95, 0.95) * kept))
    half = sqrt(kept * kept - aside * aside)
    ahead = kept + 1.0 + 4.0 * speed
    table = {
        "name": "crossing",
        "formation": {"kind": "line", "spacing": 1e-3},
        "leader": {
            "kind": "virtual",
            "trajectory": {"kind": "constant", "velocity": [speed, 0.0, 0.0]},
            "start": [0.0, 0.0, 1.2],
        },
        "graph": {"edges": [[0, 1]]},
        "drones": [{"id": 1, "start": [0.0, 0.0, 0.0]}],
        "obstacles": [{"center": [ahead, aside, 0.0], "radius": radius}],
        "limits": {"fence": {"min": [-9.0, -9.0, -0.5], "max": [15.0, 9.0, 3.0]}},
    }
    duration = 4.0 + (ahead + half) / speed + 8.0
    return Flight(merged(table, airframe), duration, detour=kept - abs(aside), forbidden=2.0 * half / speed)


def person(number: int, airframe: Table) -> Flight:
    """Send a person through a circle of five or a grid of nine at 1 m/s; drones see 3 m far and fly 1.5 m/s at most."""
    chance = Random(f"person {number}")
    followers = chance.choice((5, 8))
    formation: Table = {"kind": "grid"} if followers == 8 else {"kind": "circle", "radius": 1.2, "rate": 0.1}
    at, heading, aside = 16.0 + chance.random(), chance.uniform(-pi, pi), chance.uniform(-1.2, 1.2)
    c, s = cos(heading), sin(heading)
    start = (-4.0 * c - aside * s, -4.0 * s + aside * c, 1.2)
    fault = {"at": at, "kind": "visitor", "start": start, "velocity": (c, s, 0.0), "duration": 8.0}
    flight = _obstructed(chance, followers, formation, [], _straight(0.0), airframe, 34.0, near=True)
    fast = {"avoidance": {"sensing_radius": 3.0}, "limits": {"speed": 1.5}}  # fast enough to give way
    return Flight(merged(flight.table, fast), flight.duration, [fault])


def swap(number: int, airframe: Table) -> Flight:
    """2 to 12 drones on a circle, each with its place on the opposite side; every second time exactly symmetric."""
    chance = Random(f"swap {number}")
    count = (2, 4, 8, 12, 3, 6, 5, 10, 7, 9, 11)[number % 11]
    radius, jitter = max(1.5, count / 6.0), 0.0 if number % 2 else 0.05
    angles = [2.0 * pi * i / count for i in range(count)]
    starts = [
        (radius * cos(a) + chance.uniform(-jitter, jitter), radius * sin(a) + chance.uniform(-jitter, jitter))
        for a in angles
    ]
    places = [(-radius * cos(a), -radius * sin(a)) for a in angles]
    return _exchange(starts, places, [], airframe)


def corridor(number: int, airframe: Table) -> Flight:
    """Two to four drones exchange their sides of a wall, whose only near gap is one drone wide."""
    chance = Random(f"corridor {number}")
    pairs, jitter = chance.choice((1, 1, 2)), 0.0 if number % 2 else 0.05
    radius, half = 0.3, KEPT + chance.uniform(0.03, 0.12)
    wall = [(0.0, side * (half + radius + k * 2.0 * radius)) for side in (-1.0, 1.0) for k in range(2)]
    length = chance.choice((1, 3))
    found = [((x + 2.0 * radius * k, y), radius) for k in range(length) for x, y in wall]
    reach = 2.0 * radius * (length - 1)
    left = [(-1.6 - 0.8 * k, 0.0) for k in range(pairs)]
    right = [(reach + 1.6 + 0.8 * k, 0.0) for k in range(pairs)]
    starts = [(x + chance.uniform(-jitter, jitter), y + chance.uniform(-jitter, jitter)) for x, y in left + right]
    return _exchange(starts, right + left, found, airframe)


def circling(number: int, airframe: Table) -> Flight:
    """Nine in a grid behind a leader that circles, three obstacles that places pass at first."""
    chance = Random(f"circling {number}")
    return _passed(chance, NINE, 3, 12.0, _circle(2.0, 0.12), airframe)


def straight(number: int, airframe: Table) -> Flight:
    """Nine in a grid behind a leader on a line, two such obstacles."""
    chance = Random(f"straight {number}")
    return _passed(chance, NINE, 2, 16.0, _straight(0.3), airframe)


def early(number: int, airframe: Table) -> Flight:
    """Nine in a grid behind a leader on a line, two obstacles that no place passes later than 8 s."""
    chance = Random(f"early {number}")
    return _passed(chance, NINE, 2, 8.0, _straight(0.3), airframe, passes=False)


def free(number: int, airframe: Table) -> Flight:
    """Nine in a grid behind a leader on a line, no obstacles: only the others are in the way."""
    chance = Random(f"free {number}")
    return _passed(chance, NINE, 0, 0.0, _straight(0.2), airframe)


def drawn(number: int, airframe: Table) -> Flight:
    """5 to 12 drones 0.9 to 1.5 m apart, 1 to 4 obstacles that places pass, a leader on a line, a circle or an 8."""
    attempt = 0
    while (flight := _drawn(Random(f"drawn {number} {attempt}"), airframe)) is None:
        attempt += 1  # there was no room for the obstacles
    return flight


FAMILIES: dict[str, Callable[[int, Table], Flight]] = {
    family.__name__: family
    for family in (issue, obstacles, crossing, person, swap, corridor, circling, straight, early, free, drawn)
}


NINE = ({"kind": "grid", "spacing": 0.9}, grid(8, 0.9, 3, 0.0), 8)
Path = tuple[Table, Callable[[Point], float], Callable[[float], Point]]
"""A leader's path from the origin: its table, the distance of a point from it, the position at t, s."""


def _straight(speed: float) -> Path:
    table = {"kind": "constant", "velocity": [speed, 0.0, 0.0]}
    return table, lambda point: abs(point[1]) if point[0] > 0.0 else hypot(*point), lambda t: (speed * t, 0.0)


def _circle(radius: float, rate: float) -> Path:
    """Return a circle that begins at the origin."""
    points = [(radius * sin(0.1 * k), radius * (1.0 - cos(0.1 * k))) for k in range(63)]
    table = {"kind": "circle", "radius": radius, "rate": rate}
    return table, _from(points), lambda t: (radius * sin(rate * t), radius * (1.0 - cos(rate * t)))


def _lemniscate(size: float, speed: float) -> Path:
    """Return a figure 8 of Gerono that begins at its middle, `size` m to each end."""
    points = [(size * sin(k * pi / 24.0), 0.5 * size * sin(k * pi / 12.0)) for k in range(49)]
    table = {"kind": "waypoints", "points": [[x, y, 0.0] for x, y in points], "speed": speed, "loop": True}
    flown = Waypoints(tuple((x, y, 0.0) for x, y in points), speed, True)
    return table, _from(points), lambda t: flown.position(t)[:2]


def _from(points: list[Point]) -> Callable[[Point], float]:
    return lambda point: min(dist(point, one) for one in points)


def _drawn(chance: Random, airframe: Table) -> Flight | None:
    spacing, followers = chance.uniform(0.9, 1.5), chance.randint(4, 11)
    kind = chance.choice(("grid", "grid", "line", "circle"))
    rate = chance.uniform(-0.05, 0.05) if kind == "circle" else 0.0
    radius = max(spacing, 0.5 * spacing / sin(pi / followers))  # m, the leader is as far as the neighbours at least
    shapes: dict[str, tuple[Table, Formation]] = {
        "grid": ({"spacing": spacing}, grid(followers, spacing, 3, 0.0)),
        "line": ({"spacing": spacing, "heading": 0.5 * pi}, line(followers, spacing, 0.5 * pi, 0.0)),
        "circle": ({"radius": radius, "rate": rate}, Circle(followers, radius, rate)),
    }
    table, formation = shapes[kind]
    speed, size = chance.uniform(0.15, 0.3), chance.uniform(1.5, 2.5)
    paths = {"line": _straight(speed), "circle": _circle(size, speed / size), "lemniscate": _lemniscate(size, speed)}
    path = paths[chance.choice(("line", "circle", "lemniscate"))]
    shape = (table | {"kind": kind}, formation, followers)
    return _passed(chance, shape, chance.randint(1, 4), 14.0, path, airframe, 0.5, 300.0)


def _obstructed(
    chance: Random,
    followers: int,
    formation: Table,
    found: list[tuple[Point, float]],
    path: Path,
    airframe: Table,
    duration: float,
    near: bool = False,
) -> Flight:
    """Return a flight from random starts, of a leader that starts at the origin."""
    starts: list[Point] = [(0.0, 0.0)]
    area = 2.5 if near else AREA
    while len(starts) <= followers:
        start = (chance.uniform(-area, area), chance.uniform(-area, area))
        gaps = [dist(start, center) - radius for center, radius in found]
        if min([*gaps, *(dist(start, other) for other in starts)]) >= SPACING:
            starts.append(start)
    table = {
        "name": "around",
        "formation": formation,
        "leader": {"trajectory": path[0]},
        "graph": {"edges": [[(i - 1) // 3, i] for i in range(1, followers + 1)]},
        "drones": [{"id": i, "start": [*start, 0.0]} for i, start in enumerate(starts)],
        "obstacles": [{"center": [*center, 0.0], "radius": radius} for center, radius in found],
        "limits": {"fence": {"min": [-12.0, -12.0, -0.5], "max": [20.0, 12.0, 3.0]}},
    }
    return Flight(merged(table, airframe), duration)


def _passed(
    chance: Random,
    shape: tuple[Table, Formation, int],
    count: int,
    last: float,
    path: Path,
    airframe: Table,
    largest: float = 0.4,
    tries: float = inf,
    passes: bool = True,
) -> Flight | None:
    """Return a flight whose places pass `count` obstacles from FIRST to `last` s, none later; None after `tries`.

    If not `passes`, the obstacles may also be where no place comes, or comes from the start on.
    """
    table, formation, followers = shape
    found = list[tuple[Point, float]]()
    times = [0.1 * k for k in range(round(10.0 * LAST))]
    places = [(t, *(formation.offset(rank, t)[:2] for rank in range(followers))) for t in times]
    moved = [(t, [(path[2](t)[0] + x, path[2](t)[1] + y) for x, y in offsets]) for t, *offsets in places]
    while len(found) < count:
        tries -= 1.0
        if tries < 0.0:
            return None
        center, radius = (chance.uniform(-3.0, 4.0), chance.uniform(-3.0, 3.0)), chance.uniform(0.15, largest)
        gap = min((dist(center, other) - r - radius for other, r in found), default=9.0)
        if gap <= 0.1 or path[1](center) <= radius + LEADER_ROOM:
            continue
        nearest = [(t, min(dist(center, place) for place in now)) for t, now in moved]
        near = [t for t, least in nearest if least < radius + KEPT + 0.1]
        passed = any(least < radius + KEPT for _, least in nearest) and near[0] > FIRST
        if (passed or not passes) and not (near and near[-1] >= last):
            found.append((center, radius))
    return _obstructed(chance, followers, table, found, path, merged(TELLO, airframe), LAST)


def _exchange(starts: list[Point], places: list[Point], found: list[tuple[Point, float]], airframe: Table) -> Flight:
    """Return a flight of drones to fixed places, without a leader in the air."""
    rows = [f"{t},{i + 1},{x},{y},0" for i, (x, y) in enumerate(places) for t in (0, 1000)]
    table = {
        "name": "exchange",
        "formation": {"kind": "key_frames", "file": "-", "frames": "\n".join(("t,drone,x,y,z", *rows))},
        "leader": {
            "kind": "virtual",
            "trajectory": {"kind": "constant", "velocity": [0.0, 0.0, 0.0]},
            "start": [0.0, 0.0, 1.2],
        },
        "graph": {"edges": [[0, i + 1] for i in range(len(starts))]},
        "drones": [{"id": i + 1, "start": [*start, 0.0]} for i, start in enumerate(starts)],
        "obstacles": [{"center": [*center, 0.0], "radius": radius} for center, radius in found],
        "limits": {"fence": {"min": [-9.0, -9.0, -0.5], "max": [12.0, 9.0, 3.0]}},
    }
    way = max(dist(start, place) for start, place in zip(starts, places, strict=True))
    return Flight(merged(table, airframe), 45.0, way=way)
