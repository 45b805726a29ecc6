"""Moving bodies that are not drones, as the drones sensed them: persons, tracked obstacles, lost bodies.

A trace has them only in the messages to the drones, relative and without names: a body is known while a drone senses
it, and the same body of several drones is recognised by its place.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import hypot
from typing import NamedTuple

import numpy as np

from flockwire_analysis.recorded import Trace
from flockwire_analysis.series import Integers
from flockwire_analysis.tracking import interpolated


class MovingBody(NamedTuple):
    """An upright cylinder round (x, y), m; its height is None if no drone was above it."""

    x: float
    y: float
    radius: float
    height: float | None


def moving_bodies(trace: Trace, stamps: Integers) -> Iterator[tuple[int, list[MovingBody]]]:
    """Yield each index of `stamps` (Unix ns, equal steps) with the bodies that drones sensed in the step up to it."""
    if len(stamps) < 2:
        return
    found: dict[int, list[MovingBody]] = {}
    for number in sorted(trace.movers):
        for index, body in _placed(trace, number, stamps):
            _add(found.setdefault(index, []), body)
    yield from sorted(found.items())


def _placed(trace: Trace, number: int, stamps: Integers) -> Iterator[tuple[int, MovingBody]]:
    """Yield what one drone sensed last in each step, in the world frame, with the step's index."""
    below = 1e-6  # m below a drone from which on a body's height is known
    seen = trace.movers[number]
    steps = np.searchsorted(stamps, seen.stamps)
    newest = seen.stamps[np.searchsorted(steps, steps, side="right") - 1]
    positions = interpolated(trace.positions(number), seen.stamps) + seen.values[:, :3]
    shown = (steps < len(stamps)) & (seen.stamps == newest) & np.isfinite(positions).all(axis=1)
    rows = zip(steps[shown].tolist(), positions[shown].tolist(), seen.values[shown].tolist(), strict=True)
    for index, (x, y, z), (_, _, above, radius) in rows:
        yield index, MovingBody(x, y, radius, z if above < -below else None)


def _add(bodies: list[MovingBody], new: MovingBody) -> None:
    """Add a body, or what another drone knows of one that is in the list: its height."""
    same = 0.15  # m between two sightings of one body at about the same time
    for k, one in enumerate(bodies):
        if hypot(one.x - new.x, one.y - new.y) < same:
            bodies[k] = one._replace(height=new.height if one.height is None else one.height)
            return
    bodies.append(new)
