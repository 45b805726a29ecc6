"""One virtual flight of followers that share their places out by an auction."""

from __future__ import annotations

from math import dist
from random import Random
from typing import Any, NamedTuple

import numpy as np
from flockwire_analysis.checks import ABOUT_THE_RECORD
from flockwire_analysis.recorded import Trace
from flockwire_analysis.summary import summarise
from flockwire_analysis.tracking import interpolated
from flockwire_core.control.assignment import least_cost
from flockwire_core.control.graph import LEADER
from flockwire_core.domain.order import Mission
from flockwire_core.domain.time import SECOND
from flockwire_core.loading import parse_swarm
from flockwire_core.swarm.model import Swarm
from flockwire_lab.flight import Flight, fly_in_memory

SIDE, APART = 8.0, 1.0  # m
DURATION = 16.0  # s, from take-off to landing
COUNTS, LOSSES = (5, 8, 12), (0.0, 0.2)
SHAPES: tuple[dict[str, Any], ...] = (
    {"kind": "circle", "radius": 2.5},
    {"kind": "circle", "radius": 2.5, "rate": 0.2},
    {"kind": "grid", "spacing": 1.0},
    {"kind": "line", "spacing": 0.9, "heading": 0.7},
)


class Flown(NamedTuple):
    """What a flight showed: sums of costs in m^2, times in s after the order to start, the separation in m."""

    followers: int
    loss: float
    failed: str  # its failure, or the failed checks
    places: tuple[int | None, ...]  # by follower, at the end
    agreed: float  # when the last follower got its place for good
    settled: float | None  # after the formation's time 0
    separation: float | None
    cost: float
    optimum: float
    rejected: int

    @property
    def conflict(self) -> bool:
        """Whether not each follower has one place of its own."""
        return sorted(-1 if place is None else place for place in self.places) != list(range(self.followers))


def drawn(seed: int) -> Swarm:
    """Return a swarm on a random tree, both ways, with random starts."""
    chance = Random(f"auction {seed}")
    count, loss = COUNTS[seed % 3], LOSSES[seed // 3 % 2]
    starts = [(0.0, 0.0)]
    while len(starts) <= count:
        place = (round(SIDE * (chance.random() - 0.5), 2), round(SIDE * (chance.random() - 0.5), 2))
        if all(dist(place, other) >= APART for other in starts):
            starts.append(place)
    pairs = [[chance.randrange(1, i), i] for i in range(2, count + 1)]
    table = {
        "name": "auction",
        "control": {"law": "extended"},
        "formation": {**SHAPES[seed // 6 % 4], "assignment": "auction"},
        "leader": {"trajectory": {"kind": "constant", "velocity": [0.1, 0.05, 0.0]}},
        "graph": {"edges": [[0, 1], *pairs, *([b, a] for a, b in pairs)]},
        "sim": {"loss": loss},
        "drones": [{"id": i, "start": [*place, 0.0]} for i, place in enumerate(starts)],
    }
    return parse_swarm(table, f"flight {seed}")


def fly(seed: int) -> Flown:
    """Fly one."""
    swarm = drawn(seed)
    outcome, trace = fly_in_memory(Flight(swarm, seed, DURATION), lambda _: None)
    summary = summarise(trace)
    bad = [check.sentence() for check in summary.checks if not check.ok and check.name not in ABOUT_THE_RECORD]
    start = next((order for order in trace.missions if order.verb == "start"), None)
    if start is None:
        return Flown(len(swarm.followers), swarm.sim.loss, outcome.failure, (), 0.0, None, None, 0.0, 0.0, 0)
    costs = costs_of(trace, start)
    held = {i: [one for one in trace.held.get(i, ()) if one.order == start.version] for i in swarm.followers}
    places = tuple(held[i][-1].place if held[i] else None for i in swarm.followers)
    cost = sum(row[place] for row, place in zip(costs, places, strict=True) if place is not None)
    return Flown(
        len(swarm.followers), swarm.sim.loss, "; ".join(filter(None, (outcome.failure, *bad))), places,
        max((one[-1].stamp - start.stamp) / SECOND for one in held.values() if one),
        summary.formation_error_m.settled_s, summary.min_distance_uav_m, cost,
        sum(costs[i][j] for i, j in enumerate(least_cost(costs))),
        sum(count for one in trace.vitals for name, count in one.last.report.counts if name == "bids rejected"),
    )  # fmt: skip


def costs_of(trace: Trace, order: Mission) -> list[list[float]]:
    """Return the squared distance of each follower, at an order without a change, from each place, m^2."""
    formation = trace.swarm.build_formation(order.formation)
    at = np.array([order.stamp])
    leader, costs = interpolated(trace.positions(LEADER), at)[0], []
    for follower in trace.swarm.followers:
        here = interpolated(trace.positions(follower), at)[0] - leader
        costs.append([dist(here, formation.offset(rank, 0.0)) ** 2 for rank in range(formation.count)])
    return costs
