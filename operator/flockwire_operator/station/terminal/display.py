"""The output of `up` and `conduct` in flight: the live table, which `status` shows too, or a line for each new stage.

The table fits 80 columns. Lines are for outputs without a terminal, for processes in its background (`up … &`), and for
terminals that cannot move the cursor (TERM=dumb). Nothing here waits for the reader (runtime/standard_streams.py): the
next table is drawn after the terminal has accepted the last one.
"""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path

from flockwire_core import clock
from flockwire_core.domain.order import Version
from flockwire_core.domain.time import SECOND
from flockwire_core.pilot.off_place import AT_THE_FENCE, NO_PLACE, OFF, shown_phase
from flockwire_core.runtime.standard_streams import busy, later
from flockwire_core.swarm.wording import printable
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.status import Status
from rich.box import SIMPLE_HEAD
from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from flockwire_operator.station.operator import Operator
from flockwire_operator.station.terminal.keyboard import foreground, hint

REFRESH = SECOND // 4  # ns between two tables
ELSEWHERE = "another station ordered: {order}"
SERVING = "serving"  # the stage of a host that does not conduct the flight
SILENT = SECOND  # ns without a status
DRONES = (
    "drone", "phase", "formation", "x m", "y m", "height m", "battery", "formation\nerror mm", "pose\nms", "rate\nHz",
)  # fmt: skip
OTHERS = ("process", "phase", "rate Hz", "delay > 1 ms", "CPU", "MB", "links", "rejected")
_PHASE_STYLES: Mapping[str, str] = {
    Phase.GROUNDED: "yellow", Phase.WAITING: "yellow", Phase.LANDING: "yellow", Phase.STOPPED: "bold red",
    Phase.HOLD: "cyan", Phase.TAKEOFF: "cyan", Phase.FORMATION: "green", Phase.TRACKED: "green",
    Phase.POSE_LOST: "bold red", Phase.FULL: "bold red", OFF: "bold red", AT_THE_FENCE.code: "bold red",
    NO_PLACE: "bold red",
}  # fmt: skip


class Display:
    """Shows the processes `order` of a swarm and the stage of the flight; t = 0 is the start of the formation."""

    def __init__(self, plan: Plan, order: tuple[str, ...], headless: bool) -> None:
        self._plan, self._name, self._order = plan, plan.swarm.name, order
        self._rates = Rates()
        self._console = Console()
        self._headless = headless or self._console.is_dumb_terminal or not foreground(sys.stdout)
        self._live: Live | None = None
        self._stage = ""
        self._followed: Version | None = None  # of the newest order of another station
        self._zero: int | None = None  # time 0 of the flight, Unix ns
        self._drawn = 0

    def begin(self, out: Path) -> None:
        """Print the swarm and the trace's folder."""
        if self._headless:
            print(f"flockwire: {self._name}, {len(self._order)} processes, into {out}", flush=True)

    @contextlib.contextmanager
    def shown(self) -> Iterator[None]:
        """Show it during the context."""
        if self._headless:
            yield
            return
        self._live = Live(console=self._console, auto_refresh=False)
        self._live.start()
        try:
            yield
        finally:
            later(self._live.stop)

    def note(self, event: str) -> None:
        """Print a line about an `event`, above the table if it is shown."""
        line = self._line(event, clock.now())
        later(lambda: self._console.print(line, highlight=False, markup=False, soft_wrap=True))

    def update(self, operator: Operator, now: int) -> None:
        """Show the state of `operator` at `now`."""
        director, stage, followed = operator.core.director, SERVING, None
        if director is not None:
            stage, followed, self._zero = director.stage, director.followed, director.formation_start
        changed, self._stage = stage != self._stage, stage
        if self._live is None:
            if changed:
                print(self._line(stage, now), flush=True)
        elif (changed or now - self._drawn >= REFRESH) and not busy():
            self._drawn = now
            later(partial(self._draw, self._live, stage, dict(operator.statuses), now))
        if followed is not None and followed.version != self._followed:
            self._followed = followed.version
            self.note(ELSEWHERE.format(order=f"{followed.verb} {followed.formation}".rstrip()))

    def _draw(self, live: Live, stage: str, statuses: dict[str, Status], now: int) -> None:
        time = "" if self._zero is None else f", t = {(now - self._zero) / SECOND:.0f} s"
        title = f"{self._name}: {stage}{time}   ({hint()})"
        live.update(draw(title, self._plan, self._order, statuses, self._rates, now), refresh=True)

    def _line(self, event: str, now: int) -> str:
        time = "" if self._zero is None else f"t = {(now - self._zero) / SECOND:.1f} s: "
        return f"flockwire: {time}{printable(event)}"


class Rates:
    """Steps per second of every process, from the last two statuses at least half a second apart."""

    def __init__(self) -> None:
        self._marks: dict[str, tuple[int, int, float]] = {}  # stamp, steps, rate

    def rate(self, status: Status) -> float:
        """Return the rate, Hz, at `status`; -1 before it is known."""
        stamp, steps, rate = self._marks.get(status.identity, (status.stamp, status.steps, -1.0))
        elapsed = status.stamp - stamp
        if status.steps < steps:  # the process restarted
            stamp, steps, elapsed = status.stamp, status.steps, 0
        if elapsed >= SECOND // 2:
            rate = (status.steps - steps) * SECOND / elapsed
            stamp, steps = status.stamp, status.steps
        self._marks[status.identity] = (stamp, steps, rate)
        return rate


def draw(
    title: str, plan: Plan, order: tuple[str, ...], statuses: Mapping[str, Status], rates: Rates, now: int
) -> Group:
    """Return the table of the processes in `order`, at `now` (Unix ns)."""
    parts: list[RenderableType] = [Text(title, style="bold", no_wrap=True, overflow="ellipsis")]
    for pilots, headings, row in ((True, DRONES, _drone), (False, OTHERS, _process)):
        table = Table(box=SIMPLE_HEAD, padding=0, pad_edge=False, show_edge=False)
        for heading in headings:  # numbers are flush right
            text = heading in ("drone", "process", "phase", "formation")
            table.add_column(heading, justify="left" if text else "right", no_wrap=True, vertical="bottom")
        for identity in [identity for identity in order if plan.rows[identity].pilot == pilots]:
            status = statuses.get(identity)
            table.add_row(identity, *(["[dim]no status[/]"] if status is None else row(status, rates, now)))
        parts.append(table)
    notes = list(_notes(order, statuses, now))
    return Group(*parts, *([Text(""), *notes] if notes else []))


def _drone(status: Status, rates: Rates, now: int) -> tuple[str, ...]:
    longest_name = 12  # characters of a formation's name
    report = status.report
    x, y, z = (f"{value:.2f}" for value in report.position) if report.position is not None else ("", "", "")
    flown = report.mission if report.mission is not None and report.mission.in_formation else None
    name = "" if flown is None else _plain(flown.formation[:longest_name]) or "(first)"
    battery = "" if report.battery < 0.0 else f"{report.battery:.0%}"
    error, age = _figure(report.formation_error, 1000), _figure(report.pose_age, 1000)
    return _phase(status, now), name, x, y, z, battery, error, age, _figure(rates.rate(status), 1, 0)


def _process(status: Status, rates: Rates, now: int) -> tuple[str, ...]:
    delayed = status.delayed_1ms / status.steps if status.steps else 0.0
    return (
        _phase(status, now), _figure(rates.rate(status), 1), f"{delayed:.1%}", f"{status.cpu:.1%}",
        f"{status.resident / 2**20:.0f}", str(len(status.links)), str(sum(count for _, count in status.rejected) or ""),
    )  # fmt: skip


def _phase(status: Status, now: int) -> str:
    if now - status.stamp > SILENT:
        return "[bold red]silent[/]"
    phase = shown_phase(status.report)
    return f"[{_PHASE_STYLES.get(phase, 'default')}]{_plain(phase)}[/]"


def _notes(order: tuple[str, ...], statuses: Mapping[str, Status], now: int) -> Iterator[Text]:
    """Yield a line for each problem of a process, and for each rejection or refusal."""
    for identity in order:
        status = statuses.get(identity)
        if status is None:
            continue
        age = now - status.stamp
        said = [
            f"silent for {age / SECOND:.0f} s" if age > SILENT else "",
            status.report.line,
            f"{status.refused} connections refused" if status.refused else "",
        ]
        if text := ", ".join(filter(None, said)):
            yield Text(f"{identity}: {printable(text)}", style="dim", overflow="ellipsis", no_wrap=True)


def _plain(text: str) -> str:
    """Return `text` without markup and control characters: other processes publish it."""
    return escape(printable(text))


def _figure(value: float, factor: float, digits: int = 1) -> str:
    return "" if value < 0.0 else f"{value * factor:.{digits}f}"
