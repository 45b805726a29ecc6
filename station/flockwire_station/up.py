"""`flockwire up`: all processes of this host, watched; a flight from take-off to landing; its report.

The recorder's host conducts the flight; other hosts serve until they must end. If this station is gone, pilots land,
and their processes end when the drones are down.
"""

from __future__ import annotations

from dataclasses import dataclass

from flockwire.process.faults import Fault
from flockwire_relay.links import Relays

from flockwire_station.conduct import serve
from flockwire_station.fault_injection import FaultInjector
<<<<<<< HEAD
from flockwire_station.hosting import Host, UnansweredError, running
from flockwire_station.terminal.interrupts import interrupts
=======
from flockwire_station.flown import flown, flown_by
from flockwire_station.operator import Operator
from flockwire_station.processes import Children, PortInUseError, busy_endpoint
from flockwire_station.restarting import Restarts
from flockwire_station.terminal.display import Display
from flockwire_station.terminal.interrupts import Interrupts, interrupts

START_TIME = 10.0  # s to wait for a process before those that need it are started anyway
LEFT = "left before the drones were known to be down: they land by themselves, the recorder ends last"
>>>>>>> h-english


@dataclass(frozen=True, slots=True)
class UpOptions:
<<<<<<< HEAD
    """What to fly: this host, s of flight, whether there is a table, the faults to inject, who stays down."""
=======
    """The flight's input: plan, swarm file, this host's name, duration (s), folder, faults, drones to leave out."""
>>>>>>> h-english

    host: Host
    duration: float
    headless: bool
    faults: tuple[Fault, ...] = ()
    without: tuple[int, ...] = ()


async def fly(flight: UpOptions) -> str:
    """Fly; returns why the flight failed, empty if it did not.

    Raises PortInUseError and OtherFlightError before any process starts.
    """
<<<<<<< HEAD
    host = flight.host
    with interrupts() as interrupted:
        try:
            async with (
                Relays(flight.faults if host.conducts else (), host.plan) as relays,
                running(host, interrupted, relays.detours) as (children, operator),
            ):
                if host.conducts:
                    operator.conduct(flight.duration, flight.without)
                injector = FaultInjector(flight.faults, host.plan, host.processes, children, relays)
                return await serve(host, children, operator, injector, interrupted, flight.headless)
        except UnansweredError as error:
            return str(error)
=======
    with alone(flight):
        busy = busy_endpoint(flight.plan, flight.plan.processes_on(flight.host))
        if busy:
            raise PortInUseError(busy)
        with flown(flight.swarm_file, flown_by(flight.plan.swarm, flight.swarm_file, flight.keys)):
            async with Relays(flight.faults if flight.conducts else (), flight.plan) as relays:
                return await _fly(flight, relays)


@contextmanager
def alone(flight: UpOptions) -> Iterator[None]:
    """Hold this host's lock of the swarm; raises PortInUseError if another `up` has it.

    The lock is on a key of a process of this host; makers of keys and other hosts use other locks.
    """
    first = next(iter(flight.plan.processes_on(flight.host)), "")
    held = flight.keys / f"{first}.key"
    lock = os.open(held, os.O_RDONLY) if held.exists() else -1
    try:
        if lock >= 0:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        yield
    except BlockingIOError:
        raise PortInUseError(f"{flight.keys}: another `flockwire up` flies with these keys; end it first") from None
    finally:
        if lock >= 0:
            os.close(lock)


async def _fly(flight: UpOptions, relays: Relays) -> str:
    here = flight.plan.processes_on(flight.host)
    children = Children(flight.plan, flight.swarm_file, flight.out, flight.keys, flight.faults_file, relays.detours)
    with interrupts() as interrupted:
        try:
            session = await open_session(flight, children, here, interrupted)
            if session is None:
                return children.died() or UNANSWERED
            with session:
                operator = Operator(flight.plan, session)
                await start_processes(flight, children, here, operator, interrupted)
                injector = FaultInjector(flight.faults, flight.plan, here, children, relays)
                station = Station(flight, children, operator, injector)
                try:
                    return await station.conduct(interrupted)
                finally:
                    await injector.end()
                    await station.end()
        finally:
            await children.end(interrupted)


async def open_session(
    flight: UpOptions, children: Children, here: tuple[str, ...], interrupted: Interrupts
) -> Session | None:
    """Start this host's router, if it has one; returns the operator's session.

    Returns None if it was interrupted, or the router died, before the router answered.
    """
    for router in flight.plan.routers:
        if router in here:
            children.start(router)
    return await connected(flight.plan, OPERATOR.kind, flight.keys, interrupted, hopeless=children.died)


async def start_processes(
    flight: UpOptions, children: Children, here: tuple[str, ...], operator: Operator, interrupted: Interrupts
) -> None:
    """Start the other processes of this host, each after those that it needs."""
    plan = flight.plan
    waiting = [identity for identity in here if identity not in plan.routers]
    deadline = clock.monotonic() + nanoseconds(START_TIME)

    def turn(_: int) -> bool | None:
        late = clock.monotonic() > deadline or bool(children.died())
        for identity in tuple(waiting):
            if not interrupted.count and (late or not _awaited(plan, identity, here).difference(operator.statuses)):
                children.start(identity)
                waiting.remove(identity)
        return bool(interrupted.count) or not waiting or None

    await operator.run(turn)


def disk_full(plan: Plan, statuses: Mapping[str, Status]) -> str:
    """Return which recorder could not record the whole flight by its last status, empty when all could."""
    reports = {identity: statuses[identity].report for identity in plan.recorders if identity in statuses}
    return "; ".join(f"{identity}: {last.detail}" for identity, last in reports.items() if last.phase == Phase.FULL)


def _awaited(plan: Plan, identity: str, here: tuple[str, ...]) -> set[str]:
    """Return the processes of this host whose status `identity` waits for before it is started."""
    return {other for other in here if plan.rows[other].kind in plan.rows[identity].after}


class Station:
    """One flight of this host's processes: faults, dead processes, and the terminal."""

    def __init__(self, flight: UpOptions, children: Children, operator: Operator, injector: FaultInjector) -> None:
        plan = flight.plan
        self._flight, self._children, self._operator, self._injector = flight, children, operator, injector
        if flight.conducts:
            operator.conduct(flight.duration, flight.without)
        self._display = Display(plan, plan.processes_on(flight.host), flight.headless)
        self._restarts = Restarts(plan, children, self._display.note)

    async def conduct(self, interrupted: Interrupts) -> str:
        """Fly from take-off to landing; returns why the flight failed, empty if it did not."""
        self._display.begin(self._flight.out)
        failure = await at_terminal(self._operator, self._display, interrupted, LEFT, self._look_after)
        unrecorded = disk_full(self._flight.plan, self._operator.statuses) if self._flight.conducts else ""
        return "; ".join(filter(None, (failure, unrecorded)))

    async def end(self) -> None:
        """Wait for pending work."""
        await self._restarts.end()

    def _look_after(self, now: int) -> str:
        """Inject faults, restart dead processes; returns a line about one that cannot be restarted."""
        director = self._operator.core.director
        if director is not None and director.took_off is not None:
            self._children.took_off = director.took_off
            self._injector.step(now - director.took_off)
        return self._restarts.step()
>>>>>>> h-english
