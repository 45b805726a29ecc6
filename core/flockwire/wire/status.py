"""The status of every process, published ten times a second."""

from __future__ import annotations

from math import isfinite
from operator import itemgetter
from typing import NamedTuple

from flockwire.domain.fields import from_fields
from flockwire.domain.order import Mission, Version
from flockwire.domain.vector import ZERO, Vector
from flockwire.wire.cdr import MessageError, Reader, Writer
from flockwire.wire.orders import read_any_mission, read_versions, write_mission, write_versions
from flockwire.wire.phase import phase_of

NO_MISSION = Mission(0, "", "")

MOST_REJECTIONS = 128  # named keys and reasons in a status: the most frequent ones, the rest in one sum
MOST_LINKS = 256  # named processes in a status
MOST_REASONS = 8  # reasons in a status
LONGEST_TEXT = 256  # characters of any of its texts (bytes of UTF-8 after `bounded`)
SURELY_SHORT = LONGEST_TEXT // 4  # characters: one takes four bytes of UTF-8 at most
SERIAL = "serial"  # the code of the reason with the serial number of a driver's drone
LAW_FAILED = "law failed"  # the code of the reason with a law's error and its place
LEFT_OUT = "estimate left out"  # of the reason that names neighbours whose estimates contradict the others
PLACE = "place"  # of the reason that names the place which a follower holds by the auction
NO_PLACE_YET = "no place yet"  # of the reason of a follower that holds none, though such a formation is ordered
APART = "body apart"  # of the reason of a drone whose tracked body does not move as commanded
HOLDS = "holds place "  # before the rank, in the text of PLACE
MOST_DIGITS = 4  # of a rank
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


def place_reason(place: int | None) -> Reason:
    """Return the reason that names the `place` (rank) which a follower holds, None: none yet."""
    return Reason(NO_PLACE_YET, "holds no place yet") if place is None else Reason(PLACE, f"{HOLDS}{place}")


class Report(NamedTuple):
    """A core's report; -1 means that a figure does not apply."""

    phase: str  # a Phase, or the process's own word
    detail: str = ""  # the awaited input, or the reason of the phase
    formation_error: float = -1.0  # m, |x_i - h_i - eta_i|: by its own estimate
    pose_age: float = -1.0  # s
    estimate_age: float = -1.0  # s, of the oldest in-neighbour
    nearby_age: float = -1.0  # s
    telemetry_age: float = -1.0  # s
    battery: float = -1.0  # share of full
    mission: Mission | None = None  # the order that it obeys, as confirmation
    latency: float = -1.0  # s from a frame's capture to its publication, median
    counts: Counts = ()  # counts of bad input
    position: Vector | None = None  # m, world frame, by its own pose
    concurrent: tuple[Version, ...] = ()  # other orders that an upward order must name (pilot/orders.py)
    order_age: float = -1.0  # s since it received its newest order
    reasons: tuple[Reason, ...] = ()  # other reports, by code

    @property
    def line(self) -> str:
        """The detail and all reasons in one line."""
        if not self.reasons:
            return self.detail
        return "; ".join(filter(None, (self.detail, *(reason.line for reason in self.reasons))))

    @property
    def place(self) -> int | None:
        """The rank of the place that it holds by the auction, None without one."""
        texts = [reason.text for reason in self.reasons if reason.code == PLACE]
        rank = texts[0].removeprefix(HOLDS) if texts else ""
        return int(rank) if len(rank) <= MOST_DIGITS and rank.isascii() and rank.isdecimal() else None

    @property
    def newest(self) -> tuple[Version, ...]:
        """The orders that an upward order must name."""
        return self.concurrent if self.mission is None else (self.mission.version, *self.concurrent)


class Status(NamedTuple):
    """flockwire_msgs/Status: the state of a process."""

    stamp: int
    frame: str
    identity: str
    report: Report
    steps: int
    delayed_1ms: int  # late steps: after their due time, or the sending of a message
    delayed_5ms: int
    skipped: int
    refused: int  # connections
    cpu: float  # share of one core since the last status
    resident: int  # bytes, peak
    rejected: Counts  # messages dropped, by key
    links: tuple[str, ...]  # the processes that it is linked to
    clock_offset: float = 0.0  # s, corrected lag of its host's clock behind the swarm's
    clock_bound: float = 0.0  # s, bound of the offset; -1 before it is known

    def bounded(self) -> Status:
        """Return it with names and texts limited to those that `read_status` accepts."""
        report, rejected = self.report, self.rejected
        lists = (rejected, self.links, report.counts, report.reasons)
        if not any(lists) and len(report.detail) <= SURELY_SHORT:  # the usual case
            return self
        if len(rejected) > MOST_REJECTIONS:
            by_count = sorted(rejected, key=itemgetter(1), reverse=True)
            rest = sum([count for _, count in by_count[MOST_REJECTIONS - 1 :]])
            rejected = (*by_count[: MOST_REJECTIONS - 1], (OTHERS, rest))
        counts = _short_names(report.counts[:MOST_REJECTIONS])
        reasons = tuple([Reason(*map(_shortened, reason)) for reason in report.reasons[:MOST_REASONS]])
        report = report._replace(detail=_shortened(report.detail), counts=counts, reasons=reasons)
        links = tuple([_shortened(name) for name in self.links[:MOST_LINKS]])
        return self._replace(report=report, rejected=_short_names(rejected), links=links)


def write_status(writer: Writer, status: Status) -> None:
    """Append a status, after its stamp and frame."""
    report = status.report
    for text in (status.identity, report.phase, report.detail):
        writer.text(text)
    ages = (report.pose_age, report.estimate_age, report.nearby_age, report.telemetry_age)
    writer.put_all("d", report.formation_error, *ages, report.battery, status.cpu)
    counts = (status.steps, status.delayed_1ms, status.delayed_5ms, status.skipped, status.refused, status.resident)
    writer.put_all("Q", *counts)
    write_counts(writer, status.rejected)
    writer.texts(status.links)
    writer.put("d", report.latency)
    write_counts(writer, report.counts)
    mission = report.mission or NO_MISSION
    writer.time(mission.stamp)
    write_mission(writer, mission)
    writer.put("B", report.position is not None)
    writer.put_all("d", *(report.position or ZERO))
    writer.put_all("d", status.clock_offset, status.clock_bound)
    write_versions(writer, report.concurrent)
    writer.put("d", report.order_age)
    writer.texts(tuple([text for reason in report.reasons for text in reason]), len(Reason._fields))


def read_status(stamp: int, frame: str, reader: Reader) -> Status:
    """Read the output of `write_status`; raises MessageError."""
    identity, phase, detail = reader.text(), phase_of(reader.text()), reader.text()
    figures = reader.take_all("d", 7)
    steps, delayed_1ms, delayed_5ms, skipped, refused, resident = reader.take_all("Q", 6)
    keys, rejections, links = reader.texts(), reader.numbers("Q"), reader.texts()
    latency, names, counts = reader.take_all("d", 1)[0], reader.texts(), reader.numbers("Q")
    mission = read_any_mission(reader.time(), frame, reader)
    known, place = reader.take("B"), reader.take_all("d", 3)
    clock_offset, clock_bound = reader.take_all("d", 2)
    concurrent, order_age = read_versions(reader), reader.take_all("d", 1)[0]
    told = reader.texts(len(Reason._fields))
    if not isfinite(sum((*figures, latency, *place, clock_offset, clock_bound, order_age))):
        raise MessageError("holds a number that is not finite")
    if len(names) != len(counts) or len(names) > MOST_REJECTIONS:
        raise MessageError(f"{len(names)} names with {len(counts)} counts, {MOST_REJECTIONS} at most")
    if len(keys) > MOST_REJECTIONS or len(links) > MOST_LINKS:
        raise MessageError(f"names {len(keys)} rejections and {len(links)} links, too many")
    if len(told) > MOST_REASONS * len(Reason._fields):
        raise MessageError(f"gives {len(told) // len(Reason._fields)} reasons, {MOST_REASONS} at most")
    if max([len(text) for text in (frame, identity, phase, detail, *keys, *links, *names, *told)]) > LONGEST_TEXT:
        raise MessageError(f"holds a text of more than {LONGEST_TEXT} characters")
    if len(keys) != len(rejections):
        raise MessageError(f"{len(keys)} keys with {len(rejections)} counts")
    rejected = tuple(zip(keys, rejections, strict=True))
    error, pose, estimate, nearby, telemetry, battery, cpu = figures
    obeyed = mission if mission.stamp else None
    position = (place[0], place[1], place[2]) if known else None
    reasons = tuple([Reason(*told[k : k + 3]) for k in range(0, len(told), 3)])
    report = from_fields(Report, (
        phase, detail, error, pose, estimate, nearby, telemetry, battery, obeyed, latency,
        tuple(zip(names, counts, strict=True)), position, concurrent, order_age, reasons,
    ))  # fmt: skip
    return from_fields(Status, (
        stamp, frame, identity, report, steps, delayed_1ms, delayed_5ms, skipped, refused, cpu, resident,
        rejected, links, clock_offset, clock_bound,
    ))  # fmt: skip


def write_counts(writer: Writer, counts: Counts) -> None:
    """Append the names of `counts`, then the numbers."""
    writer.texts(tuple([name for name, _ in counts]))
    writer.numbers("Q", tuple([count for _, count in counts]))


def _short_names(counts: Counts) -> Counts:
    return tuple([(_shortened(name), count) for name, count in counts])


def _shortened(text: str) -> str:
    if len(text) <= SURELY_SHORT:
        return text
    encoded = text.encode()
    if len(encoded) <= LONGEST_TEXT:
        return text
    return encoded[: LONGEST_TEXT - 3].decode(errors="ignore") + "..."
