"""QTM as a source of the gateway: frames of bodies in its order, named by its parameters."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import isfinite
from xml.etree import ElementTree as Xml

from flockwire_core.domain.time import MICROSECOND
from flockwire_core.domain.vector import Vector
from flockwire_core.process.cores import Start

from flockwire_mocap.frame_sequence import FrameSequence
from flockwire_mocap.qualisys.rotation import from_columns
from flockwire_mocap.streamed import StreamedSource
from flockwire_mocap.tracking import ReportedBody, TrackerFrame, is_pose, unseen

Measured = tuple[Vector, Sequence[float]]  # mm, rotation matrix column by column; NaN if the body is lost


class QualisysSource(StreamedSource):
    """The bodies that a QTM server streams.

    `names` are theirs, in the order of the frames; empty if they are not those of the newest frame: then the settings
    have been changed, and no body has a name until the names are set again. `streamed` is how many bodies that
    frame has.
    """

    def __init__(self, start: Start) -> None:
        gateway = start.plan.swarm.gateway
        self.table = gateway.qualisys
        self.names: tuple[str, ...] = ()
        self.streamed = 0
        super().__init__(gateway, f"waits for {self.table.server}:{self.table.port}", self.table.latency)
        self._sequence = FrameSequence(self.counts)

    def measured(self, number: int, microseconds: int, bodies: Iterable[Measured], now: int) -> None:
        """Receive a frame that arrived at `now` (Unix ns)."""
        if self._sequence.arrived(number):
            captured = microseconds * MICROSECOND
            bodies = tuple(bodies)
            self.streamed = len(bodies)
            if self.streamed != len(self.names):
                self.names = ()
            reported = tuple(self._body(k, *body) for k, body in enumerate(bodies))
            self.arrived(TrackerFrame(number, captured, captured, reported), now)

    def _body(self, number: int, position: Vector, columns: Sequence[float]) -> ReportedBody:
        name = self.names[number] if number < len(self.names) else None
        if not isfinite(sum(position)):
            return unseen(number, name)
        orientation = from_columns(columns)
        tracked = is_pose(position, orientation)
        self.counts["poses rejected"] += not tracked
        return ReportedBody(number, name, position, orientation, tracked)


def names_in(parameters: bytes, streamed: int = 0) -> tuple[str, ...]:
    """Return the names of the bodies in QTM's settings, in the order of the frames; raises ValueError without any.

    If the frames have as many bodies (`streamed`) as are enabled, they are those.
    """
    bodies = [body for body in _tree(parameters).iterfind(".//The_6D/Body") if body.find("Name") is not None]
    enabled = [body for body in bodies if (body.findtext("Enabled") or "true").strip().lower() != "false"]
    names = tuple((body.findtext("Name") or "").strip() for body in (enabled if len(enabled) == streamed else bodies))
    if not names:
        raise ValueError("it has no rigid bodies: enable 6DOF tracking and define bodies in QTM's project options")
    return names


def _tree(parameters: bytes) -> Xml.Element:
    if b"<!" in parameters:  # a document type could define entities without end
        raise ValueError("its settings are not plain XML")
    try:
        return Xml.fromstring(parameters)  # noqa: S314
    except Xml.ParseError as error:
        raise ValueError(f"its settings are not XML: {error}") from None
