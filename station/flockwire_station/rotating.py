"""Before new keys make the old ones worthless: whether anybody flies with the old ones, on whatever host."""

from __future__ import annotations

from pathlib import Path

from flockwire.ground.fleet import IN_THE_AIR, STALE
from flockwire.runtime.session import RouterAbsentError, Session
from flockwire.security.files import CredentialsError
from flockwire.swarm.model import uav
from flockwire.wire.plan import Plan
from flockwire.wire.processes import OPERATOR

from flockwire_station.operator import Operator

LOOK_TIME = 1.5  # s in which whoever is linked has reported


async def flying(plan: Plan, keys: Path) -> tuple[str, ...]:
    """Return the drones in the air, and what flies and does not report how it is, as seen with `keys`."""
    try:
        session = Session(plan, OPERATOR.kind, keys)
    except (CredentialsError, RouterAbsentError):
        return ()  # nobody accepts these keys, or is there to accept them
    with session:
        operator = Operator(plan, session)
        await operator.watch(LOOK_TIME)
        states = operator.fleet().states
        airborne = [uav(drone) for drone, state in states.items() if state in IN_THE_AIR]
        return (*airborne, *_silent(plan, operator, session))


def _silent(plan: Plan, operator: Operator, session: Session) -> list[str]:
    """Return those linked that fly something and have no fresh status."""
    now, linked = operator.poll(), set(session.linked())
    fresh = {identity for identity, status in operator.statuses.items() if now - status.stamp < STALE}
    return [identity for identity, row in plan.rows.items() if row.flies and identity in linked - fresh]
