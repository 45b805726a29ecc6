"""What a pilot's status shows of its phase and its orders."""

from __future__ import annotations

from collections.abc import Hashable
from typing import NamedTuple

from flockwire_core.domain.order import Mission, Version
from flockwire_core.domain.time import SECOND
from flockwire_core.pilot.off_place import shown_phase
from flockwire_core.wire.status import LAW_FAILED, Status

MOST_REASONED = 5000  # changes of one process that keep their reasons: a hostile one changes its own at each status
TOO_MANY = "too many reasons to show; the trace has them"


class Observed(NamedTuple):
    """What a pilot reported at `stamp` (Unix ns), after as many `steps`; `publisher` is another after a restart.

    `reasoned`: it gave a reason for its phase. `telemetry` is the stamp (Unix ns) of that which it had, 0: none.
    """

    stamp: int
    publisher: Hashable
    steps: int
    phase: str
    mission: Mission | None
    unnumbered: tuple[Version, ...]
    reasoned: bool
    telemetry: int

    def is_as(self, other: Observed) -> bool:
        """Return whether the same pilot is in the same phase, under the same orders, with a reason or without."""
        return (
            self.phase == other.phase
            and self.reasoned == other.reasoned
            and version_of(self.mission) == version_of(other.mission)
            and self.unnumbered == other.unnumbered
            and not self.restarted_since(other)
        )

    def restarted_since(self, earlier: Observed) -> bool:
        """Return whether it comes from another process than `earlier`."""
        return self.publisher != earlier.publisher or self.steps < earlier.steps


class Shown(NamedTuple):
    """What a process reported from `stamp` (Unix ns) on, as pages show it.

    `phase` is the shown one, `why` its detail and reasons, `codes` those of its reasons, `formation` the one that it
    was ordered to fly, None: none.
    """

    stamp: int
    phase: str
    why: str = ""
    formation: str | None = None
    codes: tuple[str, ...] = ()


def shown(status: Status) -> Shown:
    """Return what pages show of a status."""
    longest_reason = 400  # characters
    report, mission = status.report, status.report.mission
    formation = mission.formation if mission is not None and mission.in_formation else None
    codes = tuple([code for code in (report.code, *(reason.code for reason in report.reasons)) if code])
    return Shown(status.stamp, shown_phase(report), report.line[:longest_reason], formation, codes)


def append_change(history: list[Shown], new: Shown) -> None:
    """Append `new` if it differs from the last one by more than its stamp; after MOST_REASONED without its reason."""
    if len(history) >= MOST_REASONED and new.why:
        new = new._replace(why=TOO_MANY)
    if not history or history[-1][1:] != new[1:]:
        history.append(new)


def observed(status: Status, publisher: Hashable) -> Observed:
    """Return what a pilot's status shows."""
    report = status.report
    age = report.telemetry_age
    return Observed(
        status.stamp, publisher, status.steps, report.phase, report.mission, report.unnumbered,
        bool(report.detail) or any(reason.code == LAW_FAILED for reason in report.reasons),
        status.stamp - round(age * SECOND) if age != -1.0 else 0,
    )  # fmt: skip


def keep(history: list[Observed], new: Observed) -> None:
    """Append `new`; of those that show the same, one after another, the first and the last are kept."""
    if len(history) > 1 and new.is_as(history[-1]) and history[-1].is_as(history[-2]):
        history[-1] = new
    else:
        history.append(new)


def version_of(mission: Mission | None) -> Version | None:
    """Return which order `mission` is, None where it is none."""
    return mission.version if mission is not None else None
