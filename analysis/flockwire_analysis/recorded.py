"""The data of a trace."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

from flockwire_core.domain.order import Mission, Stop, Version
from flockwire_core.swarm.model import Swarm, uav
from flockwire_core.wire.keys import ROWS, TIME_REQUEST, Delivery, Key
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.status import Status

from flockwire_analysis.columns import Columns
from flockwire_analysis.observed import Observed, Shown
from flockwire_analysis.series import Samples, Series, series_of


def is_repeated(kind: str) -> bool:
    """Return whether messages of a kind of key are repeated until answered, so that one may be missing."""
    return kind == TIME_REQUEST or ROWS[kind].delivery is Delivery.EVENT


def is_virtual(trace: Trace) -> bool:
    """Return whether the flight was flown in virtual time, whose date has no meaning."""
    return trace.metadata.get("world") == "virtual"


@dataclass(frozen=True, slots=True)
class ProcessRecord:
    """The record of one publisher: its `last` status, its mean share of one core, and all its links."""

    last: Status
    cpu: float
    links: tuple[str, ...]


class Held(NamedTuple):
    """From `stamp` (Unix ns) on, a follower held the place of rank `place` by the auction of `order`, None: none."""

    stamp: int
    order: Version
    place: int | None


@dataclass(frozen=True)
class Trace:
    """The data of a trace.

    `series` has the messages of each key, `movers` what each drone sensed of moving bodies, by stamp, `missions` each
    mission that a pilot obeyed once, by stamp, `orders` the others too; `vitals` one entry for each publisher of a
    status, `histories` what pilots reported of phase and orders, `shown` the changes of what pages show of a process,
    by identity, `reasons` a sentence for each reason that a process gave, by code, of those that are judged; `held`
    which places followers held by auctions; `signals` what laws recorded, by follower and name.
    `begin` and `end` are the first and the last log time (Unix ns). `lost` counts missing messages of topics that are
    not repeated, and missing orders that pilots obeyed; `lost_beside` those of optional processes alone; `malformed`
    the messages that could not be decoded. A trace that was not `closed` was read up to its last complete record;
    `lost_bytes` follow it.
    """

    path: Path
    plan: Plan
    metadata: dict[str, str]
    series: dict[Key, Series]
    movers: dict[int, Samples]
    missions: tuple[Mission, ...]
    orders: tuple[Mission, ...]
    stops: tuple[Stop, ...]
    vitals: tuple[ProcessRecord, ...]
    histories: dict[str, tuple[Observed, ...]]
    shown: dict[str, tuple[Shown, ...]]
    reasons: dict[str, tuple[str, ...]]
    begin: int
    end: int
    recorded: int
    lost: int
    lost_beside: int
    malformed: int
    closed: bool
    lost_bytes: int
    held: dict[int, tuple[Held, ...]]
    signals: dict[int, dict[str, Samples]]

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
        return self.series.get(Key(kind, uav(number))) or series_of(Columns(kind))

    def positions(self, number: int) -> Series:
        """Return the positions of drone `number`: its truth if recorded, else its pose."""
        truth = self.of("truth", number)
        return truth if len(truth) else self.of("pose", number)

    @property
    def leader(self) -> Series:
        """The positions of the leader from which the places of a formation count, none without it."""
        sole = self.swarm.sole_leader
        return series_of(Columns("pose")) if sole is None else self.positions(sole)

    def placed(self) -> tuple[int, ...]:
        """Return the drones whose position is known, ascending, virtual leaders too."""
        numbers = sorted({*self.swarm.leaders, *self.flying})
        return tuple(number for number in numbers if len(self.positions(number)))
