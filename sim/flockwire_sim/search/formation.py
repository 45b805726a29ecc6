"""The formation of a flight that is over, or flies: how far each follower is from its place, by the true positions."""

from __future__ import annotations

from math import dist

import numpy as np
from flockwire.control.graph import LEADER
from flockwire.domain.order import Mission
from flockwire.domain.time import SECOND, nanoseconds
from flockwire.domain.vector import add
from flockwire.pilot.orders import flown_place
from flockwire.swarm.model import Swarm, uav
from flockwire_analysis.separation import surface_distance

from flockwire_sim.search.record import Recorder

RECOVERY = 4 * SECOND  # ns for a follower to return to its place
AT_PLACE = 0.2  # s between two looks at the tail
TAIL = SECOND  # ns
PLACELESS = 1000.0  # m, error of a follower that holds no place of an auction


def tails(recorder: Recorder, swarm: Swarm) -> dict[str, tuple[float, float]]:
    """Return each follower's largest error in the last second before the order to land, m, and s of its time.

    Empty if the last formation had less time than `checks.settle_within`.
    """
    end = recorder.landing
    if end is None or not recorder.starts:
        return {}
    at, start = recorder.starts[-1]
    if end - max(at, start.start) < nanoseconds(swarm.checks.settle_within):
        return {}
    found: dict[str, tuple[float, float]] = {}
    for moment in range(end - TAIL, end, nanoseconds(AT_PLACE)):
        for owner, error in errors(recorder, swarm, start, moment).items():
            if owner not in found or error > found[owner][1]:
                found[owner] = (recorder.seconds(moment), error)
    return found


def errors(recorder: Recorder, swarm: Swarm, start: Mission, now: int) -> dict[str, float]:
    """Return |x_i - h_i(t) - x_0| of each follower at `now` (Unix ns), m, by the order `start`.

    A follower whose place is or just was near an obstacle, which it cannot keep, is left out.
    """
    places = recorder.places(now)
    formations = {start.formation: swarm.build_formation(start.formation)}
    auctioned, found = start.formation in swarm.auctioned, {}
    for rank, follower in enumerate(swarm.followers):
        owner = uav(follower)
        held = recorder.held(owner, now) if auctioned else None
        if auctioned and held is None:
            found[owner] = PLACELESS
            continue
        formation, index = flown_place(formations, start, rank, held)
        place = add(places[uav(LEADER)], formation.offset(index, (now - start.start) / SECOND))
        if owner in places and not _obstructed(recorder, swarm, now, index, start):
            found[owner] = dist(places[owner], place)
    return found


def _obstructed(recorder: Recorder, swarm: Swarm, now: int, index: int, start: Mission) -> bool:
    if not swarm.obstacles:
        return False
    formation = swarm.build_formation(start.formation)
    reach = swarm.avoidance.obstacle_influence_radius
    moments = np.linspace(now - RECOVERY, now, 9)
    wanted = np.array([
        add(recorder.places(int(at))[uav(LEADER)], formation.offset(index, (at - start.start) / SECOND))
        for at in moments
    ])  # fmt: skip
    return any(bool((surface_distance(wanted, obstacle) < reach).any()) for obstacle in swarm.obstacles)
