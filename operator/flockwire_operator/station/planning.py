"""Plans a change of formation in a separate process, so that the loop that sends a stop never waits for it.

Planning imports numpy and scipy and tries many changes: seconds on a busy machine. A thread would still delay the loop
by tens of ms: imports hold the interpreter's lock.
"""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Sequence

from flockwire_core import clock
from flockwire_core.domain.order import Mission
from flockwire_core.domain.vector import Vector
from flockwire_core.ground.giving import Giving
from flockwire_core.ground.order import ToPlan
from flockwire_core.swarm.model import Swarm
from flockwire_core.swarm.tables import Model
from flockwire_core.wire.codec import decode, encode

CHILD = "flockwire_operator.station.planning_child"  # the module of the child
REFUSED = 3  # exit status; the last line of the standard error says why


class PlanRefusedError(ValueError):
    """A change of formation that cannot be flown or planned; the text says why."""


class Request(Model):
    """What is to be planned: the arguments of `plan_in_time`, the order in force as its message in hexadecimal."""

    epoch: int  # ns, of the station's clock
    swarm: Swarm
    running: str
    formation: str
    leader: tuple[float, float, float] | None
    duration: float | None


class Planner:
    """Plans changes of formation beside the loop that it is called in."""

    def __init__(self) -> None:
        self._tasks: dict[Giving, asyncio.Task[None]] = {}

    def plan(self, swarm: Swarm, waiting: Sequence[Giving]) -> None:
        """Plan the change of `swarm` for each that waits for one; a plan that none waits for any more ends."""
        for given in [given for given in self._tasks if given not in waiting]:
            self._tasks.pop(given).cancel()
        for given in waiting:
            if given.to_plan is not None and given not in self._tasks:
                self._tasks[given] = asyncio.create_task(_planned(swarm, given, given.to_plan))


async def _planned(swarm: Swarm, given: Giving, change: ToPlan) -> None:
    try:
        mission = await plan_off_loop(swarm, *change)
    except (PlanRefusedError, OSError) as error:
        given.planned(None, str(error))
    else:
        given.planned(mission)


async def plan_off_loop(
    swarm: Swarm, running: Mission, name: str, leader: Vector | None, duration: float | None
) -> Mission:
    """Return the order that changes from `running` to the formation `name`, as `plan_in_time` does.

    `leader` is the leader's position (m, world frame), `duration` is in s. The fleet's orders may have changed when
    this returns. Raises PlanRefusedError.
    """
    request = Request(
        epoch=clock.now() - clock.monotonic(), swarm=swarm, running=encode(running).hex(), formation=name,
        leader=leader, duration=duration,
    )  # fmt: skip
    planner = await asyncio.create_subprocess_exec(
        sys.executable, "-P", "-m", CHILD,
        stdin=asyncio.subprocess.PIPE, stdout=asyncio.subprocess.PIPE, stderr=asyncio.subprocess.PIPE,
        start_new_session=True,  # the station handles the terminal's Ctrl-C
    )  # fmt: skip
    try:
        answer, said = await planner.communicate(request.model_dump_json().encode())
    finally:
        if planner.returncode is None:  # no longer needed
            planner.kill()
            await planner.wait()
    last = said.decode(errors="replace").strip().rpartition("\n")[2]
    if planner.returncode == REFUSED:
        raise PlanRefusedError(last)
    if planner.returncode:
        raise PlanRefusedError(f"the change could not be planned: {last or f'exit status {planner.returncode}'}")
    return decode(Mission, answer)
