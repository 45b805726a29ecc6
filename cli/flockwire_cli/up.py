"""`flockwire up`: all processes of this host, watched; a flight from take-off to landing; its report.

Of several hosts, the one that runs the recorder conducts the flight; the others serve until they are told to end.
"""

from __future__ import annotations

import asyncio
import contextlib
import signal
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from flockwire import clock
from flockwire.config import Swarm
from flockwire.director import POLL_PERIOD, Director, Stage, pilots
from flockwire.faults import Fault
from flockwire.nanoseconds import BILLION
from flockwire.session import connect
from flockwire.wiring import OPERATOR, processes_on
from rich.console import Console
from rich.live import Live

from flockwire_cli.misfortune import Misfortune
from flockwire_cli.operator import Operator
from flockwire_cli.processes import Children, PortInUseError, busy_endpoint
from flockwire_cli.relay.links import Links
from flockwire_cli.table import Rates, draw

STARTED_FIRST = ("router", "recorder")
RECORDER_HEAD_START = 0.3  # s: so that the trace has the first messages too


@dataclass(frozen=True, slots=True)
class Flight:
    """What to fly: the swarm, its file, this host's name, s from take-off to landing, the output folder, the faults."""

    swarm: Swarm
    swarm_file: Path
    host: str
    duration: float
    out: Path
    keys: Path
    headless: bool
    faults: tuple[Fault, ...] = ()
    faults_file: Path | None = None

    @property
    def conducts(self) -> bool:
        """Whether this host gives the orders, and gets the trace."""
        return "recorder" in processes_on(self.swarm, self.host)


async def fly(flight: Flight) -> str:
    """Fly; returns why the flight failed, empty when it did not. Raises PortInUseError before anything starts."""
    busy = busy_endpoint(flight.swarm, processes_on(flight.swarm, flight.host))
    if busy:
        raise PortInUseError(busy)
    async with Links(flight.faults if flight.conducts else (), flight.swarm) as links:
        return await _fly(flight, links)


async def _fly(flight: Flight, links: Links) -> str:
    identities = processes_on(flight.swarm, flight.host)
    children = Children(flight.swarm_file, flight.out, flight.keys, flight.faults_file, links.detours)
    try:
        for identity in sorted(identities, key=STARTED_FIRST.__contains__, reverse=True):
            await children.start(identity)
            if identity == "recorder":
                await asyncio.sleep(RECORDER_HEAD_START)
        session = await connect(flight.swarm, OPERATOR, flight.keys, asyncio.Event())
        assert session is not None  # noqa: S101  (only the event that nobody sets would make it so)
        with session:
            misfortune = Misfortune(flight.faults, identities, children, links)
            try:
                return await _conduct(flight, children, Operator(flight.swarm, session), misfortune)
            finally:
                await misfortune.end()
    finally:
        await children.end()


async def _conduct(flight: Flight, children: Children, operator: Operator, misfortune: Misfortune) -> str:
    director = Director(pilots(flight.swarm), flight.swarm.frame, flight.duration, clock.now())
    display = Display(flight, director)
    died = ""
    with display.shown(), _interrupts() as interrupts:
        heeded = 0
        while director.stage is not Stage.OVER and interrupts.count < 2:
            now = operator.poll()
            died = died or children.died()
            if not flight.conducts and (died or interrupts.count):
                return died
            if died and not director.failure:
                operator.order(director.abort(died, now))
            if interrupts.count > heeded:
                heeded = interrupts.count
                operator.order(director.land(now))
            if flight.conducts:
                operator.order(director.step(operator.statuses, now))
            if director.took_off is not None:
                misfortune.step(now - director.took_off)
            display.update(operator, now)
            await asyncio.sleep(POLL_PERIOD)
    return director.failure


class Interrupts:
    """How often the user asked to end."""

    def __init__(self) -> None:
        self.count = 0


@contextlib.contextmanager
def _interrupts() -> Iterator[Interrupts]:
    """Count SIGINT and SIGTERM: at the first the drones land, at the second everything ends at once."""
    loop, interrupts = asyncio.get_running_loop(), Interrupts()

    def interrupted() -> None:
        interrupts.count += 1

    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, interrupted)
    try:
        yield interrupts
    finally:
        for number in (signal.SIGINT, signal.SIGTERM):
            loop.remove_signal_handler(number)


class Display:
    """The live table, or without a terminal one line for each new stage."""

    def __init__(self, flight: Flight, director: Director) -> None:
        self._flight, self._director = flight, director
        self._order = processes_on(flight.swarm, flight.host)
        self._rates = Rates()
        self._console = Console()
        self._live: Live | None = None
        self._stage = ""
        self._began = clock.now()

    @contextlib.contextmanager
    def shown(self) -> Iterator[None]:
        """Show it for as long as the context lasts."""
        if self._flight.headless or not self._console.is_terminal:
            print(f"flockwire: {self._flight.swarm.name}, {len(self._order)} processes, into {self._flight.out}")
            yield
            return
        with Live(console=self._console, refresh_per_second=4) as self._live:
            yield

    def update(self, operator: Operator, now: int) -> None:
        """Show what is known at `now`."""
        seconds = (now - self._began) / BILLION
        if self._live is not None:
            title = f"{self._flight.swarm.name}: {self._director.stage}, {seconds:.0f} s   (Ctrl-C lands)"
            self._live.update(draw(title, self._order, operator.statuses, self._rates, now))
        elif self._stage != self._director.stage:
            print(f"flockwire: {seconds:5.1f} s  {self._director.stage}", flush=True)
        self._stage = self._director.stage


def conclude(failure: str, out: Path, trace_due: bool = True) -> int:
    """Write the report of the flight in `out`, print its figures and verdict; returns the exit status."""
    trace = out / "trace.mcap"
    failures = [failure] if failure else []
    if trace.exists():
        from flockwire_recorder.report import write_report  # noqa: PLC0415  (matplotlib takes a second to import)

        from flockwire_cli.verdict import print_summary  # noqa: PLC0415

        failures += print_summary(write_report(trace, out), out)
    elif trace_due:
        failures.append("there is no trace")
    if failures:
        print(f"flockwire: the flight failed: {'; '.join(failures)}", file=sys.stderr)
        return 1
    print("flockwire: all well")
    return 0
