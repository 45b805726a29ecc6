"""Finds drones on all hosts that fly with the old keys, before new keys replace them."""

from __future__ import annotations

from pathlib import Path

from flockwire.ground.fleet import IN_THE_AIR, STALE
from flockwire.runtime.session import RouterAbsentError, Session
from flockwire.security.files import CredentialsError
from flockwire.swarm.model import uav
from flockwire.wire.plan import Plan
from flockwire.wire.processes import OPERATOR

from flockwire_station.operator import Operator

LOOK_TIME = 1.5  # s for all linked processes to report


async def flying(plan: Plan, keys: Path) -> tuple[str, ...]:
    """Return the drones in the air, and linked processes of drones that do not report, as seen with `keys`."""
    try:
        session = Session(plan, OPERATOR.kind, keys)
    except (CredentialsError, RouterAbsentError):
        return ()  # no process accepts these keys, or none runs
    with session:
        operator = Operator(plan, session)
        await operator.watch(LOOK_TIME)
        states = operator.fleet().states
        airborne = [uav(drone) for drone, state in states.items() if state in IN_THE_AIR]
        return (*airborne, *_silent(plan, operator, session))


def _silent(plan: Plan, operator: Operator, session: Session) -> list[str]:
    """Return the linked processes of drones without a fresh status."""
    now, linked = operator.poll(), set(session.linked())
    fresh = {identity for identity, status in operator.statuses.items() if now - status.stamp < STALE}
    return [identity for identity, row in plan.rows.items() if row.flies and identity in linked - fresh]
