"""The socket of a VRPN client: it carries bytes of a `VrpnConnection`, and reconnects after a loss."""

from __future__ import annotations

import asyncio
import contextlib

from flockwire_core import clock

from flockwire_mocap.persistent import PersistentConnection, keep_alive
from flockwire_mocap.vrpn.source import VrpnSource


class VrpnClient(PersistentConnection[VrpnSource]):
    """Feeds a source with the pose reports of its server."""

    async def connected(self) -> str:
        """Pass bytes on in both directions; return the reason when the connection fails, or the server ends it."""
        source, table = self.source, self.source.table
        where = f"{table.server}:{table.port}"
        connection = source.reconnect()
        try:
            async with asyncio.timeout(3.0):  # s for the server to accept
                reader, writer = await asyncio.open_connection(table.server, table.port)
        except OSError as error:  # a time-out is one too
            return f"{where} cannot be reached ({str(error) or 'no answer'}): check address, port, firewall"
        source.failure = ""
        try:
            keep_alive(writer.transport)
            with contextlib.suppress(OSError):  # the server is gone
                writer.write(connection.outgoing())
                while connection.failed is None and (data := await reader.read(1 << 16)):
                    source.read(data, clock.now())
                    self._drained()
                    writer.write(connection.outgoing())
        finally:
            writer.close()
        return f"{where} closed: {connection.failed or 'the server has ended it, or is gone'}"
