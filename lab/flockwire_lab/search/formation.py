"""The formation of a flight that is over, or flies: how far each follower is from its place, by the true positions."""

from __future__ import annotations

import numpy as np
from flockwire_analysis.free_places import taken_places
from flockwire_analysis.series import Floats, Integers
from flockwire_analysis.tracking import Errors
from flockwire_core.domain.order import Mission
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.pilot.orders import flown_place
from flockwire_core.swarm.model import Swarm, uav

from flockwire_lab.search.record import Recorder

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
    found = errors(recorder, swarm, start, end - TAIL, end)
    worst = {owner: int(np.argmax(error.values)) for owner, error in found.items()}
    return {
        owner: (recorder.seconds(int(found[owner].stamps[k])), float(found[owner].values[k]))
        for owner, k in worst.items()
    }


def errors(recorder: Recorder, swarm: Swarm, start: Mission, begin: int, end: int) -> dict[str, Errors]:
    """Return |x_i - h_i(t) - x_0| of each follower from `begin` to `end` (Unix ns), m, by the order `start`.

    A follower is left out while its place is not free of obstacles, as the checks of a flight have it.
    """
    at_place = 0.2  # s between two looks at the tail
    first = min(start.start, begin) if swarm.obstacles else begin  # what was near an obstacle before counts
    times = np.arange(end, first - 1, -nanoseconds(at_place), dtype=np.int64)[::-1]
    true = [recorder.places(int(at)) for at in times]
    drones = {i: np.array([places[uav(i)] for places in true]) for i in swarm.followers}
    sole = swarm.sole_leader
    leader = np.array([places[uav(sole)] if sole is not None else (np.nan,) * 3 for places in true])
    places = {i: leader + _offsets(recorder, swarm, start, rank, times) for rank, i in enumerate(swarm.followers)}
    nothing = dict.fromkeys(places, np.full(len(times), -np.inf))
    taken = taken_places(swarm, times, places, drones, nothing)
    found = dict[str, Errors]()
    for i, place in places.items():
        off = np.nan_to_num(np.linalg.norm(drones[i] - place, axis=1), nan=PLACELESS)
        judged = (times >= begin) & ~taken[i]
        if judged.any():
            found[uav(i)] = Errors(times[judged], off[judged])
    return found


def _offsets(recorder: Recorder, swarm: Swarm, start: Mission, rank: int, times: Integers) -> Floats:
    """Return h_i at `times` (Unix ns) of the follower of `rank`, m, NaN while it holds no place of an auction."""
    formations = {start.formation: swarm.build_formation(start.formation)}
    auctioned, found = start.formation in swarm.auctioned, np.full((len(times), 3), np.nan)
    for k, at in enumerate(times):
        held = recorder.held(uav(swarm.followers[rank]), int(at)) if auctioned else None
        if held is not None or not auctioned:
            formation, index = flown_place(formations, start, rank, held)
            found[k] = formation.offset(index, (int(at) - start.start) / SECOND)
    return found
