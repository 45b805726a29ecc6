"""The status of every process, published ten times a second."""

from __future__ import annotations

from typing import Final, NamedTuple

from flockwire_core.domain.order import Mission, Version
from flockwire_core.domain.vector import Vector

MOST_REJECTIONS: Final = 128  # named keys and reasons in a message: the most frequent ones, the rest in one sum
MOST_LINKS: Final = 256  # named processes in a message
MOST_REASONS: Final = 8  # reasons in a message
LONGEST_TEXT: Final = 256  # characters of any text in a message (bytes of UTF-8 of those written here)
SERIAL = "serial"  # the code of the reason with the serial number of a driver's drone
LAW_FAILED = "law failed"  # the code of the reason with a law's error and its place
LEFT_OUT = "estimate left out"  # of the reason that names neighbours whose estimates contradict the others
SILENT = "neighbour silent"  # of the reason that names neighbours that a law neither sees nor hears
APART = "body apart"  # of the reason of a drone whose tracked body does not move as commanded
CORNERED = "cornered"  # of the reason, and of the count, of a drone without a way from a person (or another mover)
LAW_STEPS = "steps in formation"  # the count of those of a follower's own law
FILTERED = "steps changed by the safety filter"  # of them, but for the limit on the change of a command
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
