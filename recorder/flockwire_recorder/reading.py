"""Reads a trace, closed or cut off, into numpy arrays."""

from __future__ import annotations

import contextlib
from array import array
from collections.abc import Hashable
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np
from flockwire.control.graph import LEADER
from flockwire.loading import problems
from flockwire.swarm.model import Swarm, uav
from flockwire.wire.cdr import MessageError
from flockwire.wire.keys import ROWS, Key
from flockwire.wire.messages import Command, Estimate, Message, Mission, Pose, Stop, Telemetry
from flockwire.wire.plan import Plan
from flockwire.wire.status import Status
from mcap.records import Channel, Metadata
from mcap.records import Message as Record
from numpy.typing import NDArray

from flockwire_recorder.parts import parts
from flockwire_recorder.records import WholeRecords
from flockwire_recorder.trace import METADATA, PUBLISHER

Integers = NDArray[np.int64]
Floats = NDArray[np.float64]

_COLUMNS: dict[type[Message], int] = {Pose: 3, Estimate: 6, Command: 3, Telemetry: 4}


@dataclass(frozen=True, slots=True)
class Series:
    """The messages of one topic in the order of their stamps, one row each.

    `stamps` (for which the content holds), `published` and `logged` are Unix times in ns, `sequences` the publishers'
    counts. Columns of `values`, in m, m/s and s: pose and truth x y z; estimate x y z vx vy vz; command vx vy vz;
    telemetry flight state, battery (share of full), height, command age; none for the others.
    """

    stamps: Integers
    published: Integers
    logged: Integers
    sequences: Integers
    values: Floats

    def __len__(self) -> int:
        return len(self.stamps)


@dataclass(frozen=True, slots=True)
class ProcessRecord:
    """How one publisher fared: its `last` status, its mean share of one core, and whom it was ever linked to."""

    last: Status
    cpu: float
    links: tuple[str, ...]


class StateChange(NamedTuple):
    """From `stamp` (Unix ns) on, a process reported `phase`."""

    stamp: int
    phase: str


@dataclass(frozen=True, slots=True)
class Trace:
    """What a trace holds.

    `series` holds what was recorded of each key, `missions` each mission once, by stamp; `vitals` one entry for each
    publisher of a status, `states` by identity the changes of the phase that it reported. `begin` and `end` are the
    first and the last log time (Unix ns). `lost` counts the gaps in the publishers' sequences, `malformed` the messages
    that could not be decoded. A trace that was not `closed` was read up to its last whole record, and `lost_bytes` are
    behind that.
    """

    path: Path
    plan: Plan
    metadata: dict[str, str]
    series: dict[Key, Series]
    missions: tuple[Mission, ...]
    stops: tuple[Stop, ...]
    vitals: tuple[ProcessRecord, ...]
    states: dict[str, tuple[StateChange, ...]]
    begin: int
    end: int
    recorded: int
    lost: int
    malformed: int
    closed: bool
    lost_bytes: int

    @property
    def swarm(self) -> Swarm:
        """The swarm that flew."""
        return self.plan.swarm

    def of(self, kind: str, number: int) -> Series:
        """Return what was recorded of drone `number`'s key `kind`, possibly nothing."""
        return self.series.get(Key(kind, uav(number))) or _Columns(kind).series()

    def positions(self, number: int) -> Series:
        """Return where drone `number` was: its truth where recorded, else its pose."""
        truth = self.of("truth", number)
        return truth if len(truth) else self.of("pose", number)

    def placed(self) -> tuple[int, ...]:
        """Return the drones whose position is known: the leader's number first, virtual or not."""
        numbers = sorted({LEADER, *self.swarm.flying})
        return tuple(number for number in numbers if len(self.positions(number)))


def read_trace(path: Path) -> Trace:
    """Read the trace `path` with its further parts; what is cut off or malformed is counted, not raised.

    Raises ValueError for a file that is no MCAP or does not begin with a swarm, or a part that is of another swarm;
    OSError where one cannot be read.
    """
    collector: Collector | None = None
    files = [WholeRecords(part) for part in parts(path)]
    for records in files:
        collector = _read(records, collector)
    if collector is None:
        raise ValueError(f"{path}: names no swarm: it is another program's file, or was cut off at its very beginning")
    closed, lost_bytes = all(records.closed for records in files), sum(records.lost_bytes for records in files)
    return collector.trace(path, closed, lost_bytes)


def _read(records: WholeRecords, collector: Collector | None) -> Collector | None:
    """Read one part into `collector`, or into a new one; a part without a swarm holds nothing."""
    reader: _Reader | None = None
    for record in records:
        if reader is not None:
            reader.take(record)
        elif isinstance(record, Metadata) and record.name == METADATA:
            swarm = _swarm(records.path, record.metadata)
            if collector is not None and swarm != collector.plan.swarm:
                raise ValueError(f"{records.path}: is of another swarm than the parts of the trace before it")
            reader = _Reader(collector or Collector(swarm, record.metadata))
    return reader.collector if reader is not None else collector


def _swarm(path: Path, metadata: dict[str, str]) -> Swarm:
    try:
        swarm = Swarm.model_validate_json(metadata["swarm"])
    except (KeyError, ValueError) as error:
        raise ValueError(f"{path}: its swarm is of another version of flockwire: {error}") from error
    problem = next(problems(swarm, to_fly=False), None)
    if problem is not None:
        raise ValueError(f"{path}: its swarm is of another version of flockwire: {problem}")
    return swarm


class _Columns:
    """Collects the rows of one series."""

    def __init__(self, kind: str) -> None:
        self._times = array("q")
        self._values = array("d")
        self._width = _COLUMNS.get(ROWS[kind].message, 0)

    def add(self, message: Message, published: int, logged: int, sequence: int) -> None:
        self._times.extend((message.stamp, published, logged, sequence))
        match message:
            case Pose():
                self._values.extend(message.position)
            case Estimate():
                self._values.extend((*message.position, *message.velocity))
            case Command():
                self._values.extend(message.velocity)
            case Telemetry():
                self._values.extend((message.state, message.battery, message.height, message.command_age))

    def series(self) -> Series:
        times = np.array(self._times, np.int64).reshape(-1, 4)
        values = np.array(self._values, np.float64).reshape(len(times), self._width)
        order = np.argsort(times[:, 0], kind="stable")
        stamps, published, logged, sequences = np.ascontiguousarray(times[order].T)
        return Series(stamps, published, logged, sequences, values[order])


@dataclass(slots=True)
class _Publisher:
    """One channel: what is published on a topic by one process."""

    sequences: array[int] = field(default_factory=lambda: array("q"))
    last: Status | None = None
    cpu: float = 0.0
    links: set[str] = field(default_factory=set)

    def lost(self) -> int:
        seen = set(self.sequences)
        return max(seen) - min(seen) + 1 - len(seen) if seen else 0


class _Reader:
    """Sorts the records of a trace."""

    def __init__(self, collector: Collector) -> None:
        self.collector = collector
        plan = collector.plan
        self._keys = {f"/{plan.text(key)}": key for key in plan.keys}
        self._channels: dict[int, tuple[Key | None, Hashable]] = {}

    def take(self, record: object) -> None:
        match record:
            case Record() if record.channel_id in self._channels:
                (key, publisher), message = self._channels[record.channel_id], None
                if key is not None:
                    with contextlib.suppress(MessageError):
                        message = ROWS[key.kind].message.decode(record.data)
                self.collector.add(publisher, key, message, record.sequence, record.publish_time, record.log_time)
            case Channel(metadata=metadata) if PUBLISHER in metadata:  # the same in every part
                publisher = (record.topic, metadata[PUBLISHER])
                self._channels.setdefault(record.id, (self._keys.get(record.topic), publisher))


class Collector:
    """Collects the messages of a flight of `swarm` into a Trace."""

    def __init__(self, swarm: Swarm, metadata: dict[str, str]) -> None:
        self.plan = Plan(swarm)
        self._metadata = metadata
        self._publishers: dict[Hashable, _Publisher] = {}
        self._columns: dict[Key, _Columns] = {}
        self._missions: dict[tuple[int, str], Mission] = {}
        self._stops: dict[int, Stop] = {}
        self._states: dict[str, list[StateChange]] = {}
        self._begin = self._end = 0
        self._recorded = self._malformed = 0

    def add(
        self, channel: Hashable, key: Key | None, message: Message | None, sequence: int, published: int, logged: int
    ) -> None:
        """Add a message of `key`; both are None where they cannot be read.

        `channel` stands for a key of one publisher, `sequence` is its count, `published` and `logged` are Unix
        times in ns.
        """
        publisher = self._publishers.get(channel)
        if publisher is None:
            publisher = self._publishers[channel] = _Publisher()
        self._recorded += 1
        self._begin = min(self._begin or logged, logged)
        self._end = max(self._end, logged)
        publisher.sequences.append(sequence)
        if key is None or message is None:
            self._malformed += 1
            return
        match message:
            case Mission():
                self._missions[message.stamp, message.verb] = message
            case Stop():
                self._stops[message.stamp] = message
            case Status() if message.identity != key.owner:  # a status of somebody else is forged
                self._malformed += 1
                return
            case Status():
                publisher.last = message
                publisher.cpu += message.cpu
                publisher.links.update(message.links)
                states = self._states.setdefault(message.identity, [])
                if not states or states[-1].phase != message.report.phase:
                    states.append(StateChange(message.stamp, message.report.phase))
        columns = self._columns.get(key)
        if columns is None:
            columns = self._columns[key] = _Columns(key.kind)
        columns.add(message, published, logged, sequence)

    def trace(self, path: Path, closed: bool = True, lost_bytes: int = 0) -> Trace:
        """Return what was collected, which came from `path`."""
        return Trace(
            path, self.plan, self._metadata,
            {key: columns.series() for key, columns in self._columns.items()},
            tuple(mission for _, mission in sorted(self._missions.items())),
            tuple(stop for _, stop in sorted(self._stops.items())),
            tuple(
                ProcessRecord(publisher.last, publisher.cpu / len(publisher.sequences), tuple(sorted(publisher.links)))
                for publisher in self._publishers.values()
                if publisher.last is not None
            ),
            {identity: tuple(states) for identity, states in self._states.items()},
            self._begin, self._end, self._recorded,
            sum(publisher.lost() for publisher in self._publishers.values()),
            self._malformed, closed, lost_bytes,
        )  # fmt: skip
