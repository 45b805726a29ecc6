"""The codec of a process's status."""

from __future__ import annotations

from operator import itemgetter
from typing import Final

from flockwire_core.domain.order import Mission
from flockwire_core.domain.vector import ZERO
from flockwire_core.wire.cdr import MessageError, Reader, Writer
from flockwire_core.wire.orders import read_any_mission, read_versions, write_mission, write_versions
from flockwire_core.wire.phase import phase_of
from flockwire_core.wire.status import (
    LONGEST_TEXT,
    MOST_LINKS,
    MOST_REASONS,
    MOST_REJECTIONS,
    OTHERS,
    Counts,
    Reason,
    Report,
    Status,
)

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
