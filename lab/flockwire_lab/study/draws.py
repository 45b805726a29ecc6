"""Random starts and graphs of a swarm."""

from __future__ import annotations

from collections.abc import Iterable
from math import dist
from random import Random

from flockwire_core.swarm.model import Swarm

from flockwire_lab.study.file import RandomGraph, Starts, StudyError


def random_starts(swarm: Swarm, starts: Starts, chance: Random) -> list[tuple[float, float]]:
    """Return the starts of the swarm's drones, m, in their order; raises StudyError if the box is too full."""
    beginnings = 20
    unknown = set(starts.fixed) - set(swarm.flying)
    if unknown:
        raise StudyError(f"starts.fixed = {list(starts.fixed)}: there is no drone {min(unknown)}")
    for _ in range(beginnings):
        places = _places(swarm, starts, chance)
        if places is not None:
            return places
    raise StudyError(
        f"starts.box = {list(starts.box)}: no room for {len(swarm.drones)} drones with starts.spacing = "
        f"{starts.spacing:g} m and starts.obstacle_spacing = {starts.obstacle_spacing:g} m"
    )


def _places(swarm: Swarm, starts: Starts, chance: Random) -> list[tuple[float, float]] | None:
    tries = 2000  # tries for one drone, until all are drawn again
    (x, y), (width, depth) = starts.centre, starts.box
    found = {drone.id: drone.start[:2] for drone in swarm.drones if drone.id in starts.fixed}
    for drone in swarm.drones:
        for _ in range(tries if drone.id not in starts.fixed else 0):
            place = (x + (chance.random() - 0.5) * width, y + (chance.random() - 0.5) * depth)
            if _free(place, found.values(), swarm, starts):
                found[drone.id] = place
                break
        if drone.id not in found:
            return None
    return [found[drone.id] for drone in swarm.drones]


def _free(place: tuple[float, float], taken: Iterable[tuple[float, float]], swarm: Swarm, starts: Starts) -> bool:
    return all(dist(place, other) >= starts.spacing for other in taken) and all(
        dist(place, obstacle.center[:2]) - obstacle.radius >= starts.obstacle_spacing for obstacle in swarm.obstacles
    )


def random_edges(swarm: Swarm, graph: RandomGraph, chance: Random) -> list[list[int]]:
    """Return edges [from, to]: random trees of bounded depth from the leaders, and others; raises StudyError.

    The followers join in random order, each below any drone of the tree that is not at full depth.
    """
    followers = list(swarm.followers)
    chance.shuffle(followers)
    depth = dict.fromkeys(swarm.leaders or followers[:1], 0)
    edges = []
    for follower in followers[not swarm.leaders :]:
        above = chance.choice([drone for drone, hops in depth.items() if graph.depth is None or hops < graph.depth])
        depth[follower] = depth[above] + 1
        edges.append([above, follower])
    rest = [[i, j] for i in depth for j in followers if i != j and [i, j] not in edges]
    if graph.extra_edges > len(rest):
        raise StudyError(f"graph.extra_edges = {graph.extra_edges}: at most {len(rest)} are left beside the tree's")
    return sorted(edges + chance.sample(rest, graph.extra_edges))
