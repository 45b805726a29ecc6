"""The codec of a process's status."""

from __future__ import annotations

from typing import Final

from flockwire_core.domain.order import Mission
from flockwire_core.domain.vector import ZERO
from flockwire_core.wire.cdr import MessageError, Reader, Writer
from flockwire_core.wire.orders import read_any_mission, read_versions, write_mission, write_versions
from flockwire_core.wire.phase import phase_of
from flockwire_core.wire.stamped import check_finite
from flockwire_core.wire.status import (
    LONGEST_TEXT,
    MOST_LINKS,
    MOST_REASONS,
    MOST_REJECTIONS,
    Counts,
    Reason,
    Report,
    Status,
)

NO_PLACE: Final = -1
NO_MISSION: Final = Mission(0, "", "")


class _Orders:
    """The orders of the last statuses that were written and read, with their bytes: the next one has the same.

    Padding depends on the place, so each of eight places has its own: twice, with an order and without one. An entry
    changes at once: two threads may read messages.
    """

    def __init__(self) -> None:
        self.written: dict[int, tuple[Mission | None, bytes]] = {}
        self.read: dict[int, tuple[Mission, bytes]] = {}


_LAST: Final = _Orders()


def write_status(writer: Writer, status: Status) -> None:
    """Append a status, after its stamp and frame."""
    report = status.report
    for text in (status.identity, report.phase, report.detail):
        writer.text(text)
    writer.doubles((
        report.formation_error, report.pose_age, report.estimate_age, report.nearby_age, report.telemetry_age,
        report.battery, status.cpu,
    ))  # fmt: skip
    writer.longs((
        status.steps, status.delayed_1ms, status.delayed_5ms, status.skipped, status.refused, status.resident
    ))  # fmt: skip
    _write_counts(writer, status.rejected)
    writer.texts(status.links)
    writer.doubles((report.latency,))
    _write_counts(writer, report.counts)
    _write_order(writer, report.mission)
    writer.put("B", report.position is not None)
    x, y, z = report.position or ZERO
    writer.doubles((x, y, z, status.clock_offset, status.clock_bound))
    write_versions(writer, report.concurrent)
    writer.doubles((report.order_age,))
    writer.texts(tuple([text for reason in report.reasons for text in reason]), len(Reason._fields))
    writer.put("i", NO_PLACE if report.place is None else report.place)
    writer.text(report.code)


def _write_order(writer: Writer, order: Mission | None) -> None:
    begin = writer.position
    place = begin % 8 + (8 if order is None else 0)
    last = _LAST.written.get(place)
    if last is not None and last[0] is order:
        writer.raw(last[1])
        return
    mission = order or NO_MISSION
    writer.time(mission.stamp)
    write_mission(writer, mission)
    _LAST.written[place] = order, writer.finish()[begin:]


def _read_order(frame: str, reader: Reader) -> Mission:
    begin = reader.position
    place = begin % 8
    for last in (_LAST.read.get(place), _LAST.read.get(place + 8)):
        if last is not None and last[0].frame == frame and reader.skips(last[1]):
            return last[0]
    mission = read_any_mission(reader.time(), frame, reader)
    _LAST.read[place if mission.stamp else place + 8] = mission, reader.since(begin)
    return mission


def read_status(stamp: int, frame: str, reader: Reader) -> Status:
    """Read the output of `write_status`; raises MessageError."""
    identity, phase, detail = reader.text(), phase_of(reader.text()), reader.text()
    figures, numbers = reader.doubles(7), reader.longs(6)
    keys, rejections, links = reader.texts(), reader.numbers("Q"), reader.texts()
    latency, names, counts = reader.doubles(1)[0], reader.texts(), reader.numbers("Q")
    mission = _read_order(frame, reader)
    known, place = reader.take("B"), reader.doubles(5)
    concurrent, order_age = read_versions(reader), reader.doubles(1)[0]
    told = reader.texts(len(Reason._fields))
    held, code = reader.take("i"), reader.text()
    total = latency + order_age
    for figure in figures:
        total += figure
    for figure in place:
        total += figure
    check_finite(total)
    if len(names) != len(counts) or len(names) > MOST_REJECTIONS:
        raise MessageError(f"{len(names)} names with {len(counts)} counts, {MOST_REJECTIONS} at most")
    if len(keys) > MOST_REJECTIONS or len(links) > MOST_LINKS:
        raise MessageError(f"names {len(keys)} rejections and {len(links)} links, too many")
    if len(told) > MOST_REASONS * len(Reason._fields):
        raise MessageError(f"gives {len(told) // len(Reason._fields)} reasons, {MOST_REASONS} at most")
    for text in (frame, identity, phase, detail, code, *keys, *links, *names, *told):
        if len(text) > LONGEST_TEXT:
            raise MessageError(f"holds a text of more than {LONGEST_TEXT} characters")
    if len(keys) != len(rejections):
        raise MessageError(f"{len(keys)} keys with {len(rejections)} counts")
    report = Report(
        phase, detail, figures[0], figures[1], figures[2], figures[3], figures[4], figures[5],
        mission if mission.stamp else None, latency, tuple(zip(names, counts, strict=True)),
        (place[0], place[1], place[2]) if known else None, concurrent, order_age,
        tuple([Reason(*told[k : k + 3]) for k in range(0, len(told), 3)]),
        held if held >= 0 else None, code,
    )  # fmt: skip
    return Status(
        stamp, frame, identity, report, numbers[0], numbers[1], numbers[2], numbers[3], numbers[4], figures[6],
        numbers[5], tuple(zip(keys, rejections, strict=True)), links, place[3], place[4],
    )  # fmt: skip


def _write_counts(writer: Writer, counts: Counts) -> None:
    writer.texts(tuple([name for name, _ in counts]))
    writer.numbers("Q", tuple([count for _, count in counts]))
