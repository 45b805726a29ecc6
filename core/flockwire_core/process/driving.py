"""Common parts of all airframes' processes: the driver of one drone, times, the ground."""

from __future__ import annotations

from typing import Final, cast

from flockwire_core.domain.time import SECOND
from flockwire_core.objects import load_object
from flockwire_core.process.cores import Core, Start

TELEMETRY_PERIOD = SECOND // 10  # ns
SETTLED = SECOND  # ns with all drones on the ground before the process may end
RETIREMENT = 20 * SECOND  # ns for pilots to land their drones when the process must end
TOLERANCE = 1.05  # share of the speed limit above which a command is clipped: the safety filter may reach the limit
GRAVITY: Final = 9.81  # m/s^2
CONTACT: Final = 0.01  # m above the ground at which a descending simulated airframe has landed
FROZEN = SECOND // 4  # ns: over a longer pause of the process the simulated world is frozen, too


def make_driver(start: Start) -> Core:
    """Return the core of the driver of one drone, as the airframe table names it."""
    return cast("Core", load_object(start.plan.swarm.row(start.drone).driver)(start))
