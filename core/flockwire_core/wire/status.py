"""The status of every process, published ten times a second, and its codec."""

from __future__ import annotations

from operator import itemgetter
from typing import Final, NamedTuple

from flockwire_core.domain.order import Mission, Version
from flockwire_core.domain.vector import ZERO, Vector
from flockwire_core.wire.cdr import MessageError, Reader, Writer
from flockwire_core.wire.orders import read_any_mission, read_versions, write_mission, write_versions
from flockwire_core.wire.phase import phase_of

MOST_REJECTIONS: Final = 128  # named keys and reasons in a message: the most frequent ones, the rest in one sum
MOST_LINKS: Final = 256  # named processes in a message
MOST_REASONS: Final = 8  # reasons in a message
LONGEST_TEXT: Final = 256  # characters of any text in a message (bytes of UTF-8 of those written here)
SERIAL = "serial"  # the code of the reason with the serial number of a driver's drone
LAW_FAILED = "law failed"  # the code of the reason with a law's error and its place
LAW_SLOW = "law slow"  # that of a law whose steps take longer than the control period
MOTORS_OFF = "motors off"  # of the reason of an airframe that stopped its motors by itself; its text begins with uavN
LEFT_OUT = "estimate left out"  # of the reason that names neighbours whose estimates contradict the others
SILENT = "neighbour silent"  # of the reason that names neighbours that a law neither sees nor hears
APART = "body apart"  # of the reason of a drone whose tracked body does not move as commanded
CORNERED = "cornered"  # of the reason, and of the count, of a drone without a way from a person (or another mover)
LAW_STEPS = "steps in formation"  # the count of those of a follower's law, with the safety filter
FILTERED = "steps changed by the safety filter"  # of them, but for its limits of speed and acceleration
CONFLICTS = "steps changed for drones and people"  # of those, of a law of ours: both want the same space
OTHERS = "others"  # the sum of unnamed rejections


Counts = tuple[tuple[str, int], ...]  # name and count


def counted(*counts: tuple[str, int]) -> Counts:
    """Return the counts that are not zero."""
    return tuple([count for count in counts if count[1]])


class Reason(NamedTuple):
    """A reported fact: its code, its text, and a remedy if it is a problem."""

    code: str
    text: str
    remedy: str = ""  # empty without a problem

    @property
    def line(self) -> str:
        """The reason as text."""
        return f"{self.text}: {self.remedy}" if self.remedy else self.text


NO_PLACE_YET: Final = Reason("no place yet", "holds no place yet")  # of a follower that the auction gives none


class Report(NamedTuple):
    """A core's report; -1 means that a figure does not apply.

    Attributes:
        phase: a Phase, or the process's own word.
        detail: the awaited input, or the reason of the phase.
        formation_error: m, |x_i - h_i - eta_i|: by its own estimate.
        pose_age, nearby_age, telemetry_age: s.
        estimate_age: s, of the oldest in-neighbour.
        battery: share of full.
        mission: the order that it obeys, as confirmation.
        latency: s from a frame's capture to its publication, median.
        counts: counts of bad input.
        position: m, world frame, by its own pose.
        unnumbered: holds and landings that it received, and the gateway's log has not numbered yet (pilot/orders.py).
        order_age: s since it received its newest order.
        place: the rank of the place that it holds by the auction, None without one.
        code: of the reason of a pilot's phase (pilot/reactions.py).
        reasons: other reports, by code.

    """

    phase: str
    detail: str = ""
    formation_error: float = -1.0
    pose_age: float = -1.0
    estimate_age: float = -1.0
    nearby_age: float = -1.0
    telemetry_age: float = -1.0
    battery: float = -1.0
    mission: Mission | None = None
    latency: float = -1.0
    counts: Counts = ()
    position: Vector | None = None
    unnumbered: tuple[Version, ...] = ()
    order_age: float = -1.0
    reasons: tuple[Reason, ...] = ()
    place: int | None = None
    code: str = ""

    @property
    def line(self) -> str:
        """The detail, all reasons and the place in one line."""
        place = "" if self.place is None else f"holds place {self.place}"
        return "; ".join(filter(None, (self.detail, *(reason.line for reason in self.reasons), place)))


class Status(NamedTuple):
    """flockwire_msgs/Status: the state of a process.

    Attributes:
        delayed_1ms, delayed_5ms: late steps, after their due time, or the sending of a message.
        refused: connections.
        cpu: share of one core since the last status.
        resident: bytes, peak.
        rejected: messages dropped, by key.
        links: the processes that it is linked to.
        clock_offset: s, corrected lag of its host's clock behind the swarm's.
        clock_bound: s, bound of the offset; -1 before it is known.

    """

    stamp: int
    frame: str
    identity: str
    report: Report
    steps: int
    delayed_1ms: int
    delayed_5ms: int
    skipped: int
    refused: int
    cpu: float
    resident: int
    rejected: Counts
    links: tuple[str, ...]
    clock_offset: float = 0.0
    clock_bound: float = 0.0


NO_MISSION: Final = Mission(0, "", "")


def write_status(writer: Writer, status: Status) -> None:
    """Append a status, after its stamp and frame, with its lists and texts shortened."""
    report = status.report
    for text in (status.identity, report.phase, report.detail):
        writer.text(_shorten(text))
    for figure in (
        report.formation_error, report.pose_age, report.estimate_age, report.nearby_age, report.telemetry_age,
        report.battery, status.cpu,
    ):  # fmt: skip
        writer.double(figure)
    for number in (
        status.steps, status.delayed_1ms, status.delayed_5ms, status.skipped, status.refused, status.resident
    ):  # fmt: skip
        writer.long(number)
    _write_counts(writer, _most_frequent(status.rejected))
    writer.texts(tuple([_shorten(name) for name in status.links[:MOST_LINKS]]))
    writer.double(report.latency)
    _write_counts(writer, report.counts[:MOST_REJECTIONS])
    mission = report.mission or NO_MISSION
    writer.time(mission.stamp)
    write_mission(writer, mission)
    writer.byte(int(report.position is not None))
    writer.vector(report.position or ZERO)
    writer.double(status.clock_offset)
    writer.double(status.clock_bound)
    write_versions(writer, report.unnumbered)
    writer.double(report.order_age)
    texts = tuple([_shorten(text) for reason in report.reasons[:MOST_REASONS] for text in reason])
    writer.texts(texts, len(Reason._fields))
    writer.put_all("i", -1 if report.place is None else report.place)
    writer.text(_shorten(report.code))


def _write_counts(writer: Writer, counts: Counts) -> None:
    writer.texts(tuple([_shorten(name) for name, _ in counts]))
    writer.numbers("Q", tuple([count for _, count in counts]))


def _most_frequent(counts: Counts) -> Counts:
    """Return the most frequent MOST_REJECTIONS of `counts`, the rest as one sum."""
    if len(counts) <= MOST_REJECTIONS:
        return counts
    by_count = sorted(counts, key=itemgetter(1), reverse=True)
    rest = sum([count for _, count in by_count[MOST_REJECTIONS - 1 :]])
    return (*by_count[: MOST_REJECTIONS - 1], (OTHERS, rest))


def _shorten(text: str) -> str:
    encoded = text.encode()
    if len(encoded) <= LONGEST_TEXT:
        return text
    return encoded[: LONGEST_TEXT - 3].decode(errors="ignore") + "..."


def read_status(stamp: int, frame: str, reader: Reader) -> Status:
    """Read the output of `write_status`; raises MessageError."""
    identity, phase, detail = _text(reader), phase_of(_text(reader)), _text(reader)
    figures, numbers = [reader.double() for _ in range(7)], [reader.long() for _ in range(6)]
    rejected, links, latency, counts = _read_counts(reader), _texts(reader), reader.double(), _read_counts(reader)
    mission = read_any_mission(reader.time(), frame, reader)
    known, position, clock_offset, clock_bound = reader.byte(), reader.vector(), reader.double(), reader.double()
    unnumbered, order_age = read_versions(reader), reader.double()
    reasons = tuple([Reason(_text(reader), _text(reader), _text(reader)) for _ in range(reader.length())])
    place, code = reader.take("i"), _text(reader)
    report = Report(
        phase, detail, figures[0], figures[1], figures[2], figures[3], figures[4], figures[5],
        mission if mission.stamp else None, latency, counts, position if known else None, unnumbered, order_age,
        reasons, place if place >= 0 else None, code,
    )  # fmt: skip
    return Status(
        stamp, frame, identity, report, numbers[0], numbers[1], numbers[2], numbers[3], numbers[4], figures[6],
        numbers[5], rejected, links, clock_offset, clock_bound,
    )  # fmt: skip


def _read_counts(reader: Reader) -> Counts:
    names, counts = _texts(reader), reader.numbers("Q")
    if len(names) != len(counts):
        raise MessageError(f"{len(names)} names with {len(counts)} counts")
    return tuple(zip(names, counts, strict=True))


def _texts(reader: Reader) -> tuple[str, ...]:
    return tuple([_text(reader) for _ in range(reader.length())])


def _text(reader: Reader) -> str:
    text = reader.text()
    if len(text) > LONGEST_TEXT:
        raise MessageError(f"holds a text of more than {LONGEST_TEXT} characters")
    return text
