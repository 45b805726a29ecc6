"""A flight without some of its drones: its permission by the graph, and its consequences."""

from __future__ import annotations

from collections.abc import Iterator
from math import inf

from flockwire_core.control.convergence import convergence
from flockwire_core.control.graph import Graph
from flockwire_core.swarm.model import Swarm, uav


def refusal(swarm: Swarm, without: tuple[int, ...]) -> str:
    """Return why the swarm cannot fly `without` these drones, empty if it can (Lemma 3: a spanning tree remains)."""
    for drone in without:
        if drone in swarm.leaders:
            return f"--without {drone}: a leader cannot be left out"
        if drone not in swarm.followers:
            return f"--without {drone}: must be one of {list(swarm.followers)}"
    left, chosen = _left(swarm, without), ", ".join(map(str, without))
    if not left.followers:
        return f"--without {chosen}: at least one follower must fly"
    if swarm.leaders and (lost := left.unreachable()):
        return f"--without {chosen}: no spanning tree from a leader is left, none reaches {', '.join(map(uav, lost))}"
    if swarm.auctioned and (ends := left.parted()):
        one, other = map(uav, ends)
        return f"--without {chosen}: no links are left from {one} to {other}, which assignment = 'auction' needs"
    return ""


def consequences(swarm: Swarm, without: tuple[int, ...]) -> Iterator[str]:
    """Yield a sentence for each drone that loses a neighbour, and one on Lemma 3; nothing if no drone is left out."""
    if not without:
        return
    left = _left(swarm, without)
    for i in left.followers:
        lost = [uav(j) for j in swarm.topology.neighbours(i) if j in without]
        if lost:
            kept = ", ".join(map(uav, left.neighbours(i)))
            yield f"{uav(i)} loses {', '.join(lost)} and receives only from {kept}"
    if swarm.sole_leader is None:
        return
    lemma = [
        convergence(graph, swarm.observer.gain, swarm.observer.exponent, swarm.reference.input_bound)
        for graph in (swarm.topology, left)
    ]
    bounds = ["none" if each.settling_time_bound == inf else f"{each.settling_time_bound:.1f} s" for each in lemma]
    yield (
        f"lambda_min(Lhat) {lemma[0].lambda_min:.5f} -> {lemma[1].lambda_min:.5f}, settling time bound "
        f"{bounds[0]} -> {bounds[1]}; the places of {', '.join(map(uav, without))} stay empty"
    )


def _left(swarm: Swarm, without: tuple[int, ...]) -> Graph:
    """Return the graph of the remaining drones."""
    followers = tuple(i for i in swarm.followers if i not in without)
    edges = tuple(edge for edge in swarm.graph.edges if not {edge[0], edge[1]}.intersection(without))
    return Graph(followers, edges, tuple(swarm.leading))
