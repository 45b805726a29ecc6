"""The live table of a flight: drones, other processes, and their problems; it fits 80 columns."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from flockwire_core.domain.time import SECOND
from flockwire_core.pilot.off_place import AT_THE_FENCE, NO_PLACE, OFF, shown_phase
from flockwire_core.swarm.wording import printable
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.status import Status
from rich.box import SIMPLE_HEAD
from rich.console import Group, RenderableType
from rich.markup import escape
from rich.table import Table
from rich.text import Text

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
