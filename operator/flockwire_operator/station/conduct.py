"""A flight conducted at a terminal: `flockwire up`, of all processes of this host, `conduct`, of running ones.

The recorder's host conducts the flight; other hosts serve until they must end. If this station is gone, pilots land,
and their processes end when the drones are down.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from flockwire_core.domain.time import SECOND
from flockwire_core.ground.delivery import LOOK_TIME
from flockwire_core.ground.director import Stage
from flockwire_core.ground.fleet import unrecorded
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.processes import OPERATOR
from flockwire_lab.faults.kinds import Fault
from flockwire_lab.relay.links import Relays

from flockwire_operator.station.connecting import UNANSWERED, connected
from flockwire_operator.station.fault_injection import FaultInjector
from flockwire_operator.station.host import Host
from flockwire_operator.station.operator import Operator
from flockwire_operator.station.processes import Children, UnansweredError, running
from flockwire_operator.station.restarts import Restarts
from flockwire_operator.station.terminal.display import Display
from flockwire_operator.station.terminal.interrupts import LEFT_EARLY, Interrupts, interrupts
from flockwire_operator.station.terminal.keyboard import Keyboard, keys_pressed

LEFT_TO_THEMSELVES = f"{LEFT_EARLY}: they land by themselves, the recorder ends last; then `flockwire report`"
LEFT = f"{LEFT_EARLY}; `flockwire land` lands them, `flockwire report` draws the trace"


async def fly(
    host: Host, duration: float, headless: bool, faults: tuple[Fault, ...] = (), without: tuple[int, ...] = ()
) -> str:
    """Start the processes of `host` and fly `duration` s without the drones `without`.

    Returns why the flight failed, empty if it did not. Raises PortInUseError and OtherFlightError before any process
    starts.
    """
    with interrupts() as interrupted:
        try:
            async with (
                Relays(faults if host.conducts else (), host.plan) as relays,
                running(replace(host, environments=relays.environments), interrupted) as (children, operator),
            ):
                if host.conducts:
                    operator.conduct(duration, without)
                injector = FaultInjector(faults, host, children, relays)
                return await serve(host, children, operator, injector, interrupted, headless)
        except UnansweredError as error:
            return str(error)


async def conduct(plan: Plan, keys: Path, duration: float, out: Path | None, headless: bool) -> str:
    """Fly from take-off to landing; returns why the flight failed, empty if it did not.

    The first interrupt lands. Raises CredentialsError.
    """
    comes_back = 10 * SECOND  # ns in which a supervisor has started a process again that ended in flight
    with interrupts() as interrupted:
        session = await connected(plan, OPERATOR.kind, keys, interrupted)
        if session is None:
            return UNANSWERED
        with session:
            operator, display = Operator(session), Display(plan, plan.started, headless)
            # Without a gateway this host's time is used.
            await operator.watch(LOOK_TIME / SECOND, lambda: operator.core.knows_time)
            operator.conduct(duration, grace=comes_back)
            if out is not None:
                display.begin(out)
            return await at_terminal(operator, display, interrupted, LEFT)


async def serve(
    host: Host,
    children: Children,
    operator: Operator,
    injector: FaultInjector,
    interrupted: Interrupts,
    headless: bool = False,
) -> str:
    """Look after the processes of `host` until the flight that `operator` conducts is over, or until interrupted.

    Returns why it failed, empty when it did not. Faults are injected, and what died is started again.
    """
    display = Display(host.plan, host.processes, headless)
    display.begin(host.out)
    restarts = Restarts(host.plan, children, display.note)

    def look_after(now: int) -> str:
        died, director = restarts.step(now), operator.core.director
        if director is not None and director.took_off is not None:
            children.took_off = director.took_off
            injector.step(now - director.took_off)
        return died

    failure = await at_terminal(operator, display, interrupted, LEFT_TO_THEMSELVES, look_after)
    lost = unrecorded(host.plan.recorders, operator.statuses) if host.conducts else ""
    return "; ".join(filter(None, (failure, lost)))


async def at_terminal(
    operator: Operator,
    display: Display,
    interrupted: Interrupts,
    left: str,
    beside: Callable[[int], str] = lambda _: "",
) -> str:
    """Run `operator` with keys, interrupts and the table until the flight ends; returns why it failed, or empty.

    The first interrupt lands; at the second it returns, and `left` is a reason. If another host conducts, it returns at
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
            return "; ".join(filter(None, (director.failure, left)))
        if died:
            operator.core.abort(died, now)
        if interrupted.count > handled:
            handled = interrupted.count
            operator.core.order("land", now)
        return None

    with display.shown(), keys_pressed(Keyboard(lambda verb: operator.order(verb, display.note)).press):
        return await operator.run(turn)
