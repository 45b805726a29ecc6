"""QTM as a source of the gateway, by the package qtm-rt: frames of bodies in its order, named by its parameters."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable, Iterable, Sequence
from math import hypot, isfinite
from typing import Any
from xml.etree import ElementTree as Xml

from flockwire_core import clock
from flockwire_core.domain.pose import Quaternion
from flockwire_core.domain.time import MICROSECOND
from flockwire_core.domain.vector import Vector
from flockwire_core.process.cores import Start

from flockwire_mocap.persistent import PersistentConnection, imported, keep_alive
from flockwire_mocap.streamed import FrameSequence, StreamedSource
from flockwire_mocap.tracking import ReportedBody, TrackerFrame, is_pose, unseen

ANSWER_TIMEOUT = 2.0  # s for the server to answer
NAMES_PERIOD = 5.0  # s between two requests of names: the settings may be changed at any time
NAMES_PAUSE = 1.0  # s between two at least
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


def from_columns(columns: Sequence[float]) -> Quaternion:
    """Return the unit quaternion of a rotation matrix, column by column; all zeros if it is none.

        4 w² = 1 + trace,   4 x² = 1 + R11 − R22 − R33,  …;   4 w x = R32 − R23,   4 x y = R12 + R21,  …

    All are divided by the largest of the four, never by a small number (S. Shepperd, 1978).
    """
    a, b, c, d, e, f, g, h, i = columns
    candidates = (
        (f - h, g - c, b - d, 1.0 + a + e + i),
        (1.0 + a - e - i, b + d, c + g, f - h),
        (b + d, 1.0 - a + e - i, f + h, g - c),
        (c + g, f + h, 1.0 - a - e + i, b - d),
    )
    x, y, z, w = max(candidates, key=lambda q: hypot(*q))
    length = hypot(x, y, z, w)
    return (x / length, y / length, z / length, w / length) if length > 0.0 else (0.0, 0.0, 0.0, 0.0)


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


class QualisysClient(PersistentConnection[QualisysSource]):
    """Feeds a source with the frames of its server.

    Raises OSError if qtm-rt is not installed.
    """

    def __init__(self, source: QualisysSource, drained: Callable[[], None]) -> None:
        super().__init__(source, drained)
        self._package = imported("qtm_rt", "qualisys")
        self._where = f"{source.table.server}:{source.table.port}"
        self._lost, self._changed = asyncio.Event(), asyncio.Event()

    async def connected(self) -> str:
        """Stream until the connection is lost; returns the reason."""
        table, self._lost = self.source.table, asyncio.Event()
        self._changed.clear()
        try:
            async with asyncio.timeout(ANSWER_TIMEOUT):
                connection = await self._package.connect(
                    table.server,
                    port=table.port,
                    on_event=lambda _: self._changed.set(),
                    on_disconnect=lambda _: self._lost.set(),
                    timeout=ANSWER_TIMEOUT,
                )
        except TimeoutError:
            return f"{self._where} connects, but does not answer like QTM: set the port for little-endian (22223)"
        if connection is None:
            return f"{self._where} cannot be reached: check address, port (little-endian: 22223), firewall"
        try:
            if connection.has_transport():
                keep_alive(connection._protocol.transport)
            return await self._stream(connection)
        except (ValueError, TimeoutError, self._package.QRTCommandException) as error:
            return f"{self._where}: {str(error) or 'no answer'}"
        finally:
            with contextlib.suppress(Exception):
                connection.disconnect()

    async def _stream(self, connection: Any) -> str:  # noqa: ANN401  (qtm-rt has no types)
        self.source.names = names_in(await connection.get_parameters(["6d"]))
        self.source.failure = f"{self._where} answers, but streams nothing: start a measurement or the preview in QTM"
        streaming = asyncio.ensure_future(connection.stream_frames(components=["6d"], on_packet=self._packet))
        renewing = asyncio.ensure_future(self._keep_names(connection))
        try:  # the first frame confirms it, which may take long
            await self._lost.wait()
        finally:
            renewing.cancel()
            streaming.cancel()
            await asyncio.gather(streaming, renewing, return_exceptions=True)
        return f"{self._where} has closed the connection, or is gone"

    async def _keep_names(self, connection: Any) -> None:  # noqa: ANN401
        """Request the names again and again, at once if they may have changed; without an answer they remain.

        The package pairs answers with requests by their order, so there is none before frames answer that for them.
        """
        while True:
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(NAMES_PERIOD):
                    await self._changed.wait()
            self._changed.clear()
            if not self.source.failure:
                with contextlib.suppress(ValueError, TimeoutError, self._package.QRTCommandException):
                    settings = await connection.get_parameters(["6d"])
                    self.source.names = names_in(settings, self.source.streamed)
            await asyncio.sleep(NAMES_PAUSE)

    def _packet(self, packet: Any) -> None:  # noqa: ANN401
        now, found = clock.now(), packet.get_6d()
        if found is None:
            return
        self.source.failure = ""
        bodies = [((place.x, place.y, place.z), turn.matrix) for place, turn in found[1]]
        self.source.measured(packet.framenumber, packet.timestamp, bodies, now)
        if not self.source.names:
            self._changed.set()
        self._drained()
