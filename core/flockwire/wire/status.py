"""The status that every process publishes of itself, ten times a second."""

from __future__ import annotations

from math import isfinite
from typing import NamedTuple, Self

from flockwire.wire.cdr import MessageError, Reader, Writer
from flockwire.wire.messages import Mission

NO_MISSION = Mission(0, "", "")

MOST_REJECTIONS = 32  # keys and reasons that one status names; the most frequent ones, the rest in one sum
MOST_LINKS = 256  # processes that one status names
LONGEST_TEXT = 256  # characters of any of its texts (bytes of UTF-8, of a detail)
FULL = "full"  # the phase of a recorder whose disk takes no more
OTHERS = "others"  # the sum of those rejections that are not named


class Report(NamedTuple):
    """What a core knows of itself; -1 stands for a figure that does not apply."""

    phase: str
    detail: str = ""  # what it waits for, or why it is in this phase
    formation_error: float = -1.0  # m, |x_i - h_i - eta_i|: by its own estimate
    pose_age: float = -1.0  # s
    estimate_age: float = -1.0  # s, of the oldest in-neighbour
    nearby_age: float = -1.0  # s
    telemetry_age: float = -1.0  # s
    battery: float = -1.0  # share of full
    mission: Mission | None = None  # the order that it obeys: how an operator knows that it arrived


class Status(NamedTuple):
    """flockwire_msgs/Status: how a process is."""

    stamp: int
    frame: str
    identity: str
    report: Report
    steps: int
    late_1ms: int
    late_5ms: int
    skipped: int
    refused: int  # connections
    cpu: float  # share of one core since the last status
    resident: int  # bytes
    rejected: tuple[tuple[str, int], ...]  # key, messages dropped
    links: tuple[str, ...]  # the processes that it is linked to

    def bounded(self) -> Status:
        """Return it with no more, and no longer, names and texts than `decode` takes."""
        report, rejected = self.report, self.rejected
        if len(rejected) > MOST_REJECTIONS:
            by_count = sorted(rejected, key=_count, reverse=True)
            rest = sum([count for _, count in by_count[MOST_REJECTIONS - 1 :]])
            rejected = (*by_count[: MOST_REJECTIONS - 1], (OTHERS, rest))
        if len(report.detail.encode()) > LONGEST_TEXT:
            report = report._replace(detail=_shortened(report.detail))
        return self._replace(report=report, rejected=rejected, links=self.links[:MOST_LINKS])

    def encode(self) -> bytes:
        """Return the CDR bytes."""
        writer, report = Writer(), self.report
        writer.time(self.stamp)
        for text in (self.frame, self.identity, report.phase, report.detail):
            writer.text(text)
        ages = (report.pose_age, report.estimate_age, report.nearby_age, report.telemetry_age)
        writer.put_all("d", report.formation_error, *ages, report.battery, self.cpu)
        writer.put_all("Q", self.steps, self.late_1ms, self.late_5ms, self.skipped, self.refused, self.resident)
        writer.texts(tuple(key for key, _ in self.rejected))
        writer.numbers("Q", tuple(count for _, count in self.rejected))
        writer.texts(self.links)
        mission = report.mission or NO_MISSION
        writer.time(mission.stamp)
        writer.text(mission.verb)
        writer.time(mission.start)
        writer.text(mission.formation)
        return writer.finish()

    @classmethod
    def decode(cls, data: bytes) -> Self:
        """Read CDR bytes; raises MessageError."""
        reader = Reader(data)
        stamp, frame, identity = reader.time(), reader.text(), reader.text()
        phase, detail = reader.text(), reader.text()
        figures = reader.take_all("d", 7)
        if not isfinite(sum(figures)):
            raise MessageError("holds a number that is not finite")
        steps, late_1ms, late_5ms, skipped, refused, resident = map(int, reader.take_all("Q", 6))
        keys, rejections, links = reader.texts(), reader.numbers("Q"), reader.texts()
        mission = Mission(reader.time(), frame, reader.text(), reader.time(), reader.text())
        reader.end()
        if len(keys) > MOST_REJECTIONS or len(links) > MOST_LINKS:
            raise MessageError(f"names {len(keys)} rejections and {len(links)} links, too many")
        if max([len(text) for text in (frame, identity, phase, detail, *keys, *links)]) > LONGEST_TEXT:
            raise MessageError(f"holds a text of more than {LONGEST_TEXT} characters")
        if len(keys) != len(rejections):
            raise MessageError(f"{len(keys)} keys with {len(rejections)} counts")
        rejected = tuple(zip(keys, rejections, strict=True))
        error, pose, estimate, nearby, telemetry, battery, cpu = figures
        obeyed = mission if mission.stamp else None
        report = Report(phase, detail, error, pose, estimate, nearby, telemetry, battery, obeyed)
        return cls(
            stamp, frame, identity, report, steps, late_1ms, late_5ms, skipped, refused, cpu, resident,
            rejected, links,
        )  # fmt: skip


def _count(rejection: tuple[str, int]) -> int:
    return rejection[1]


def _shortened(text: str) -> str:
    return text.encode()[: LONGEST_TEXT - 3].decode(errors="ignore") + "..."
