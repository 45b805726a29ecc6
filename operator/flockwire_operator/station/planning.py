"""Plans a change of formation in a thread, so that the loop that sends a stop never waits for it.

The first plan imports numpy and scipy: then the loop is late once, by 0.05 s (0.16 s on a machine with ten times its
load), later by the interpreter's switch interval.
"""

from __future__ import annotations

import asyncio
from collections.abc import Sequence

from flockwire_core import clock
from flockwire_core.domain.order import Mission
from flockwire_core.ground.delivery import OrderDelivery
from flockwire_core.ground.order import ChangeRequest
from flockwire_core.objects import load_object
from flockwire_core.swarm.model import Swarm

PLAN = "flockwire_core.ground.formation_planning:plan_in_time"  # needs the extra `station`: numpy and scipy


class Planner:
    """Plans changes of formation beside the loop that it is called in."""

    def __init__(self) -> None:
        self._tasks: dict[OrderDelivery, asyncio.Task[None]] = {}

    def plan(self, swarm: Swarm, waiting: Sequence[OrderDelivery]) -> None:
        """Plan the change of `swarm` for each that waits for one; a plan that none waits for any more is dropped."""
        for given in [given for given in self._tasks if given not in waiting]:
            self._tasks.pop(given).cancel()
        for given in waiting:
            if given.to_plan is not None and given not in self._tasks:
                self._tasks[given] = asyncio.create_task(_answer(swarm, given, given.to_plan))


async def _answer(swarm: Swarm, given: OrderDelivery, change: ChangeRequest) -> None:
    try:
        mission = await asyncio.to_thread(plan_order, swarm, change)
    except ValueError as error:  # ChangeRefusedError: it cannot be flown
        given.planned(None, str(error))
    except Exception as error:  # the order waits for an answer
        given.planned(None, f"the change could not be planned: {type(error).__name__}: {error}")
    else:
        given.planned(mission)


def plan_order(swarm: Swarm, change: ChangeRequest) -> Mission:
    """Return the order for `change`. Raises ChangeRefusedError."""
    order: Mission = load_object(PLAN)(
        swarm, change.running, change.formation, clock.now, change.leader, change.duration
    )
    return order
