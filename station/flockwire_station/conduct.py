"""A flight conducted at a terminal; `flockwire conduct`: of processes that were started separately."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from flockwire.domain.time import SECOND
from flockwire.ground.director import Stage
from flockwire.ground.giving import LOOK_TIME
from flockwire.wire.plan import Plan
from flockwire.wire.processes import OPERATOR

from flockwire_station.connecting import UNANSWERED, connected
from flockwire_station.operator import Operator
from flockwire_station.terminal.display import Display
from flockwire_station.terminal.interrupts import Interrupts, interrupts
from flockwire_station.terminal.keyboard import Keyboard, keys_pressed

COMES_BACK = 10 * SECOND  # ns for a supervisor to restart a process that ended in flight
LEFT = "left before the drones were known to be down; `flockwire land` lands them"


async def conduct(plan: Plan, keys: Path, duration: float, out: Path | None, headless: bool) -> str:
    """Fly from take-off to landing; returns why the flight failed, empty if it did not.

    The first interrupt lands. Raises CredentialsError.
    """
    with interrupts() as interrupted:
        session = await connected(plan, OPERATOR.kind, keys, interrupted)
        if session is None:
            return UNANSWERED
        with session:
            operator, display = Operator(plan, session), Display(plan, plan.started, headless)
            # Without a gateway this host's time is used.
            await operator.watch(LOOK_TIME / SECOND, lambda: operator.core.knows_time)
            operator.conduct(duration, grace=COMES_BACK)
            if out is not None:
                display.begin(out)
            return await at_terminal(operator, display, interrupted, LEFT)


async def at_terminal(
    operator: Operator,
    display: Display,
    interrupted: Interrupts,
    left: str,
    beside: Callable[[int], str] = lambda _: "",
) -> str:
    """Run `operator` with keys, interrupts and the table until the flight ends; returns why it failed, or empty.

    The first interrupt lands; at the second it returns, with the reason `left`. If another host conducts, it returns at
    the first. `beside` is called at each turn with the time, Unix ns; it returns a reason to end the flight, or empty.
    """
    handled, died = 0, ""

    def turn(now: int) -> str | None:
        nonlocal handled, died
        died = beside(now) or died
        display.update(operator, now)
        director = operator.core.director
        if director is None:
            return died if died or interrupted.count else None
        if director.stage is Stage.OVER:
            return director.failure
        if interrupted.count > 1:
            return director.failure or left
        if died:
            operator.core.abort(died, now)
        if interrupted.count > handled:
            handled = interrupted.count
            operator.core.order("land", now)
        return None

    with display.shown(), keys_pressed(Keyboard(lambda verb: operator.order(verb, display.note))):
        return await operator.run(turn)
