"""Random graphs: who hears whom, drawn so that the leader reaches everybody."""

from __future__ import annotations

from random import Random

from flockwire.control.graph import LEADER
from flockwire.swarm.model import Swarm

from flockwire_sim.study.file import RandomGraph, StudyError


def random_edges(swarm: Swarm, graph: RandomGraph, chance: Random) -> list[list[int]]:
    """Return edges [from, to]: a random tree of bounded depth from the leader, and others; raises StudyError.

    The followers join in random order, each under any drone that is in the tree and not yet at its full depth.
    """
    followers = list(swarm.followers)
    chance.shuffle(followers)
    depth = {LEADER: 0}
    edges = []
    for follower in followers:
        above = chance.choice([drone for drone, hops in depth.items() if graph.depth is None or hops < graph.depth])
        depth[follower] = depth[above] + 1
        edges.append([above, follower])
    rest = [[i, j] for i in depth for j in followers if i != j and [i, j] not in edges]
    if graph.extra_edges > len(rest):
        raise StudyError(f"graph.extra_edges = {graph.extra_edges}: at most {len(rest)} are left beside the tree's")
    return sorted(edges + chance.sample(rest, graph.extra_edges))
