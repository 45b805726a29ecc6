"""Positions and velocities of the drones at any instants, and their references."""

from __future__ import annotations

import numpy as np
from flockwire.control.graph import LEADER
from flockwire.domain.time import SECOND

from flockwire_analysis.phases import formation_phases, offsets
from flockwire_analysis.recorded import Trace
from flockwire_analysis.series import Booleans, Floats, Integers
from flockwire_analysis.tracking import interpolated

WINDOW = SECOND // 20  # ns, window of a velocity


def places(trace: Trace, number: int, times: Integers) -> Floats:
    """Return x_i in m, one row for each of `times` (Unix ns), NaN if it is unknown."""
    return interpolated(trace.positions(number), times)


def references(trace: Trace, number: int, times: Integers) -> Floats:
    """Return the place x_0 + h_i of a follower in m, NaN outside the formation phases; of the leader: unknown."""
    if number == LEADER:
        return np.full((len(times), 3), np.nan)
    wanted = offsets(trace, number, times) + interpolated(trace.positions(LEADER), times)
    wanted[~in_formation(trace, times)] = np.nan
    return wanted


def velocities(trace: Trace, number: int, times: Integers) -> Floats:
    """Return the velocity in m/s from displacements over WINDOW."""
    half = WINDOW // 2
    return (places(trace, number, times + half) - places(trace, number, times - half)) * (SECOND / WINDOW)


def reference_velocities(trace: Trace, number: int, times: Integers) -> Floats:
    """Return the velocity of a follower's place, m/s."""
    half = WINDOW // 2
    return (references(trace, number, times + half) - references(trace, number, times - half)) * (SECOND / WINDOW)


def in_formation(trace: Trace, times: Integers) -> Booleans:
    """Return which of `times` are in a formation phase, not hovering or landing."""
    within = np.zeros(len(times), np.bool_)
    for phase in formation_phases(trace):
        within |= phase.span.holds(times)
    return within
