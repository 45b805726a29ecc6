"""Collects the messages of a trace into the data of a flight."""

from __future__ import annotations

from array import array
from collections.abc import Hashable, Iterator
from operator import attrgetter
from pathlib import Path
from typing import Final

from flockwire_core.domain.order import Mission, Stop, Version
from flockwire_core.swarm.model import Swarm, uav
from flockwire_core.wire.codec import Message
from flockwire_core.wire.keys import ROWS, Key
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.status import APART, LAW_FAILED, LAW_SLOW, LEFT_OUT, MOTORS_OFF, Status
from flockwire_recorder.trace import count_lost, publication_time

from flockwire_analysis.columns import Columns
from flockwire_analysis.observed import Observed, Shown, append_change, keep, observed, shown
from flockwire_analysis.recorded import Held, ProcessRecord, Trace, is_repeated
from flockwire_analysis.series import movers_of, series_of, signals_of

DAY: Final = 86_400 * 1_000_000_000  # ns
FOREVER: Final = 1 << 61  # ns
WATCHED = frozenset(kind for kind, row in ROWS.items() if row.message in (Mission, Stop, Status))
REASONS: Final = (LAW_FAILED, LEFT_OUT, APART, MOTORS_OFF, LAW_SLOW)  # codes of those that are judged
FOLLOWED: Final = 20  # messages in succession that show that the clock was set by more than a day


class _Publisher:
    """One channel: the messages of one process on a topic, `repeated` until answered or not, `judged` or not.

    `rate` is its largest number of messages per s, `columns` are where they go: None for a key that is unknown.
    Each message of one that is `watched` is looked at.
    """

    def __init__(self, key: Key | None, judged: bool, columns: Columns | None) -> None:
        self.repeated, self.judged, self.columns = key is not None and is_repeated(key.kind), judged, columns
        self.rate = 0 if key is None else ROWS[key.kind].rate
        self.watched = key is not None and key.kind in WATCHED
        self.sequences = array("q")
        self.last: Status | None = None
        self.cpu = 0.0
        self.links: set[str] = set()


class Collector:
    """Collects the messages of a flight of `swarm` into a Trace."""

    def __init__(self, swarm: Swarm, metadata: dict[str, str]) -> None:
        self.plan = Plan(swarm)
        self._metadata = metadata
        self._publishers: dict[Hashable, _Publisher] = {}
        self._columns: dict[Key, Columns] = {}
        self._missions: dict[Version, Mission] = {}
        self._obeyed: set[Version] = set()  # missions that a process obeyed
        self._stops: dict[int, Stop] = {}
        self._held: dict[int, list[Held]] = {}
        self._bidders = {self.plan.pilots[i]: i for i in swarm.followers if swarm.auctioned}
        self._histories: dict[str, list[Observed]] = {identity: [] for identity in self.plan.pilots.values()}
        self._shown: dict[str, list[Shown]] = {}
        self._about: dict[str, tuple[object, ...]] = {}  # what the last status of a process told beside figures
        self._reasons: dict[str, dict[str, None]] = {code: {} for code in REASONS}
        self._begin = self._end = self._newest = 0
        self._recorded = self._malformed = self._strays = 0

    def add(
        self, channel: Hashable, key: Key | None, message: Message | None, sequence: int, published: int, logged: int,
        size: int = 0,
    ) -> None:  # fmt: skip
        """Add a message of `key`; both are None if they cannot be read.

        `channel` identifies key and publisher, `sequence` is the publisher's count. `published` (claimed by the
        publisher) and `logged` are Unix times in ns, `size` is that of its payload in bytes.
        """
        self._recorded += 1
        logged = self._log_time(logged)
        publisher = self._publishers.get(channel)
        if publisher is None:
            columns = None if key is None else self._columns.setdefault(key, Columns(key.kind))
            judged = key is None or key in self.plan.judged
            publisher = self._publishers[channel] = _Publisher(key, judged, columns)
        publisher.sequences.append(sequence)
        self._end = max(self._end, logged)
        if logged < self._begin or not self._begin:
            self._begin = logged
        if key is None or message is None or publisher.columns is None:
            self._malformed += 1
        elif not publisher.watched or self._watch(publisher, channel, key, message):
            publisher.columns.size += size
            publisher.columns.add(message, publication_time(published, logged), logged, sequence)

    def _watch(self, publisher: _Publisher, channel: Hashable, key: Key, message: Message) -> bool:
        """Take a message of orders or statuses; returns whether it is no forgery."""
        if isinstance(message, Mission):
            self._missions[message.version] = message
        elif isinstance(message, Stop):
            self._stops[message.stamp] = message
        elif isinstance(message, Status):
            if message.identity != key.owner:  # a status of another process
                self._malformed += 1
                return False
            self._take_status(publisher, channel, message)
        return True

    def _log_time(self, claimed: int) -> int:
        """Return `claimed`, or the last log time if it is a day away from that and few others are with it."""
        if claimed <= FOREVER and (not self._newest or abs(claimed - self._newest) <= DAY):
            self._newest, self._strays = claimed, 0
            return claimed
        self._malformed += 1
        self._strays += claimed <= FOREVER
        if self._strays >= FOLLOWED:
            if self._recorded < 2 * FOLLOWED:  # the first ones were the strays
                self._begin = self._end = claimed
            self._newest = claimed
        return self._newest

    def _take_status(self, publisher: _Publisher, channel: Hashable, message: Status) -> None:
        before, publisher.last = publisher.last, message
        publisher.cpu += message.cpu
        publisher.links.update(message.links)
        if (history := self._histories.get(message.identity)) is not None:
            keep(history, observed(message, channel))
        report = message.report
        about = (report.phase, report.detail, report.code, report.reasons, report.place, report.mission)
        if about != self._about.get(message.identity):  # a status repeats them ten times a second
            self._about[message.identity] = about
            self._take_change(message, before)

    def _take_change(self, message: Status, before: Status | None) -> None:
        """Take what is new in a status."""
        if (obeyed := message.report.mission) is not None:
            self._obeyed.add(obeyed.version)
            if (number := self._bidders.get(message.identity)) is not None:
                has_had = before is not None and before.report.place is not None
                self._take_held(number, Held(message.stamp, obeyed.version, message.report.place), has_had)
        for reason in message.report.reasons:
            if (found := self._reasons.get(reason.code)) is not None:
                found[f"{message.identity}: {reason.text}"] = None
        append_change(self._shown.setdefault(message.identity, []), shown(message))

    def _take_held(self, number: int, held: Held, may_lose: bool) -> None:
        """Take a place that is new; a process that was just started has none to lose."""
        history = self._held.setdefault(number, [])
        another = bool(history) and held.place != history[-1].place and (held.place is not None or may_lose)
        if another or not history or history[-1].order != held.order:
            history.append(held)

    def trace(self, path: Path, closed: bool = True, lost_bytes: int = 0) -> Trace:
        """Return the data collected from `path`."""
        lost_orders = sum([stamp >= self._begin for stamp, _ in self._obeyed - self._missions.keys()])
        obeyed = self._obeyed or self._missions.keys()
        orders = tuple(order for _, order in sorted(self._missions.items()))
        return Trace(
            path, self.plan, self._metadata,
            {key: series_of(columns) for key, columns in self._columns.items()},
            {i: movers_of(one) for i, one in self._of("nearby") if one.sensed},
            tuple(order for order in orders if order.version in obeyed),  # without rejected ones
            orders,
            tuple(stop for _, stop in sorted(self._stops.items())),
            tuple(self._vitals()),
            {identity: tuple(history) for identity, history in self._histories.items()},
            {identity: tuple(changes) for identity, changes in self._shown.items()},
            {code: tuple(found) for code, found in self._reasons.items()},
            self._begin, self._end, self._recorded,
            lost_orders + self._lost(judged=True), self._lost(judged=False),
            self._malformed, closed, lost_bytes,
            {number: tuple(sorted(held, key=attrgetter("stamp"))) for number, held in self._held.items()},
            {i: signals_of(one) for i, one in self._of("signals")},
        )  # fmt: skip

    def _vitals(self) -> Iterator[ProcessRecord]:
        for publisher in self._publishers.values():
            if publisher.last is not None:
                cpu = publisher.cpu / len(publisher.sequences)
                yield ProcessRecord(publisher.last, cpu, tuple(sorted(publisher.links)))

    def _of(self, kind: str) -> list[tuple[int, Columns]]:
        """Return the messages of a kind of key by drone, where there are any."""
        found = [(i, self._columns.get(Key(kind, uav(i)))) for i in self.plan.swarm.flying]
        return [(i, one) for i, one in found if one is not None]

    def _lost(self, judged: bool) -> int:
        """Return the number of missing messages of keys that are judged, or of all others.

        A repeated message may have no link after its process was stopped for a while.
        """
        publishers = [one for one in self._publishers.values() if one.judged == judged and not one.repeated]
        return sum(count_lost(one.sequences, one.rate, self._end - self._begin) for one in publishers)
