"""The live table of a flight."""

from __future__ import annotations

from collections.abc import Mapping

from flockwire.nanoseconds import BILLION
from flockwire.wire.status import Status
from rich.markup import escape
from rich.table import Table

_PHASE_STYLES = {
    "grounded": "yellow", "waiting": "yellow", "landing": "yellow", "stopped": "bold red", "full": "bold red",
    "hold": "cyan", "take-off": "cyan", "formation": "green",
}  # fmt: skip


class Rates:
    """Steps per second of every process, from the last two statuses at least half a second apart."""

    def __init__(self) -> None:
        self._marks: dict[str, tuple[int, int, float]] = {}  # stamp, steps, rate

    def rate(self, status: Status) -> float:
        """Return the rate, Hz, as of `status`."""
        stamp, steps, rate = self._marks.get(status.identity, (status.stamp, status.steps, 0.0))
        elapsed = status.stamp - stamp
        if status.steps < steps:  # the process restarted
            stamp, steps, elapsed = status.stamp, status.steps, 0
        if elapsed >= BILLION // 2:
            rate = (status.steps - steps) * BILLION / elapsed
            stamp, steps = status.stamp, status.steps
        self._marks[status.identity] = (stamp, steps, rate)
        return rate


def draw(title: str, order: tuple[str, ...], statuses: Mapping[str, Status], rates: Rates, now: int) -> Table:
    """Return the table: one row for each identity in `order`."""
    table = Table(title=title, title_justify="left", title_style="bold", expand=False)
    table.add_column("process")
    table.add_column("phase", min_width=22)
    for heading in (
        "error mm",
        "pose ms",
        "estimate ms",
        "rate Hz",
        "late >1 ms",
        "CPU",
        "MB",
        "links",
        "rejected",
        "refused",
    ):
        table.add_column(heading, justify="right")
    for identity in order:
        status = statuses.get(identity)
        if status is None:
            table.add_row(identity, "[dim]starting[/]")
            continue
        table.add_row(*_row(status, rates, now))
    return table


def _row(status: Status, rates: Rates, now: int) -> tuple[str, ...]:
    report = status.report
    silent = (now - status.stamp) / BILLION
    style = _PHASE_STYLES.get(report.phase, "default")
    phase = f"[{style}]{_plain(report.phase)}[/]" + (f" [dim]{_plain(report.detail)}[/]" if report.detail else "")
    if silent > 1.0:
        phase = f"[bold red]silent for {silent:.0f} s[/]"
    late = status.late_1ms / status.steps if status.steps else 0.0
    return (
        status.identity, phase, _figure(report.formation_error, 1000), _figure(report.pose_age, 1000),
        _figure(report.estimate_age, 1000), f"{rates.rate(status):.1f}", f"{late:.1%}", f"{status.cpu:.1%}",
        f"{status.resident / 2**20:.0f}", str(len(status.links)),
        str(sum(count for _, count in status.rejected) or ""), str(status.refused or ""),
    )  # fmt: skip


def _plain(text: str) -> str:
    """Return `text` as it may reach a terminal: what others publish is not markup, and controls nothing."""
    return escape("".join(character for character in text if character.isprintable()))


def _figure(value: float, factor: float) -> str:
    return "" if value < 0.0 else f"{value * factor:.1f}"
