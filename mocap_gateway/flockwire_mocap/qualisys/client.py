"""The connection to a QTM server by the package qtm-rt, which reconnects after each failure."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable
from typing import Any

from flockwire_core import clock

from flockwire_mocap.persistent import PersistentConnection, imported, keep_alive
from flockwire_mocap.qualisys.source import QualisysSource, names_in

ANSWER_TIMEOUT = 2.0  # s for the server to answer
NAMES_PERIOD = 5.0  # s between two requests of names: the settings may be changed at any time
NAMES_PAUSE = 1.0  # s between two at least


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
