"""The data of a trace, and what a pilot's statuses show of its phase and its orders."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

from flockwire.control.graph import LEADER
from flockwire.domain.order import Mission, Stop, Version
from flockwire.domain.time import SECOND
from flockwire.swarm.model import Swarm, uav
from flockwire.wire.keys import ROWS, TIME_REQUEST, Delivery, Key
from flockwire.wire.plan import Plan
from flockwire.wire.status import LAW_FAILED, Status

from flockwire_analysis.series import Columns, Series


def is_repeated(kind: str) -> bool:
    """Return whether messages of a kind of key are repeated until answered, so that one may be missing."""
    return kind == TIME_REQUEST or ROWS[kind].delivery is Delivery.EVENT


@dataclass(frozen=True, slots=True)
class ProcessRecord:
    """The record of one publisher: its `last` status, its mean share of one core, and all its links."""

    last: Status
    cpu: float
    links: tuple[str, ...]


class StateChange(NamedTuple):
    """From `stamp` (Unix ns) on, a process reported `phase`."""

    stamp: int
    phase: str


class Observed(NamedTuple):
    """What a pilot reported at `stamp` (Unix ns), after as many `steps`; `publisher` is another after a restart.

    `reasoned`: it gave a reason for its phase. `telemetry` is the stamp (Unix ns) of that which it had, 0: none.
    """

    stamp: int
    publisher: Hashable
    steps: int
    phase: str
    mission: Mission | None
    concurrent: tuple[Version, ...]
    reasoned: bool
    telemetry: int

    def is_as(self, other: Observed) -> bool:
        """Return whether the same pilot is in the same phase, under the same orders, with a reason or without."""
        return (
            self.phase == other.phase
            and self.reasoned == other.reasoned
            and version_of(self.mission) == version_of(other.mission)
            and self.concurrent == other.concurrent
            and not self.restarted_since(other)
        )

    def restarted_since(self, earlier: Observed) -> bool:
        """Return whether it comes from another process than `earlier`."""
        return self.publisher != earlier.publisher or self.steps < earlier.steps


def observed(status: Status, publisher: Hashable) -> Observed:
    """Return what a pilot's status shows."""
    report = status.report
    age = report.telemetry_age
    return Observed(
        status.stamp, publisher, status.steps, report.phase, report.mission, report.concurrent,
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


@dataclass(frozen=True)
class Trace:
    """The data of a trace.

    `series` has the messages of each key, `missions` each mission once, by stamp; `vitals` one entry for each publisher
    of a status, `states` the changes of reported phases by identity, `histories` what pilots reported of phase and
    orders, `failed_laws` a sentence for each error of a law, `contradictions` one for each input that a pilot took for
    false. `begin` and `end` are the first and the last log time (Unix ns). `lost` counts missing messages of topics
    that are not repeated, and missing orders that pilots obeyed; `lost_beside` those of dispensable processes alone;
    `malformed` the messages that could not be decoded. A trace that was not `closed` was read up to its last complete
    record; `lost_bytes` follow it.
    """

    path: Path
    plan: Plan
    metadata: dict[str, str]
    series: dict[Key, Series]
    missions: tuple[Mission, ...]
    stops: tuple[Stop, ...]
    vitals: tuple[ProcessRecord, ...]
    states: dict[str, tuple[StateChange, ...]]
    histories: dict[str, tuple[Observed, ...]]
    failed_laws: tuple[str, ...]
    contradictions: tuple[str, ...]
    begin: int
    end: int
    recorded: int
    lost: int
    lost_beside: int
    malformed: int
    closed: bool
    lost_bytes: int

    @property
    def swarm(self) -> Swarm:
        """The swarm that flew."""
        return self.plan.swarm

    @cached_property
    def left_out(self) -> tuple[int, ...]:
        """The drones that all orders left on the ground."""
        orders = [set(mission.without) for mission in self.missions if mission.verb != "land"]
        return tuple(sorted(set.intersection(*orders))) if orders else ()

    @cached_property
    def flying(self) -> tuple[int, ...]:
        """The drones that were not left out, ascending."""
        return tuple(number for number in self.swarm.flying if number not in self.left_out)

    @cached_property
    def followers(self) -> tuple[int, ...]:
        """The followers that were not left out, ascending."""
        return tuple(number for number in self.swarm.followers if number not in self.left_out)

    @property
    def was_ordered_up(self) -> bool:
        """Whether any order made drones take off."""
        return any(mission.verb not in ("prepare", "hold", "land") for mission in self.missions)

    def of(self, kind: str, number: int) -> Series:
        """Return the messages of drone `number`'s key `kind`, possibly none."""
        return self.series.get(Key(kind, uav(number))) or Columns(kind).series()

    def positions(self, number: int) -> Series:
        """Return the positions of drone `number`: its truth if recorded, else its pose."""
        truth = self.of("truth", number)
        return truth if len(truth) else self.of("pose", number)

    def placed(self) -> tuple[int, ...]:
        """Return the drones whose position is known: the leader's number first, virtual or not."""
        numbers = sorted({LEADER, *self.flying})
        return tuple(number for number in numbers if len(self.positions(number)))
