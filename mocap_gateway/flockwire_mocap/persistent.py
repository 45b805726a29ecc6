"""A connection that reconnects after each loss, until it is closed."""

from __future__ import annotations

import asyncio
import logging
from abc import ABC, abstractmethod
from typing import ClassVar

from flockwire.wire.processes import GATEWAY


class PersistentConnection(ABC):
    """Connects, and reconnects `PAUSE` s after each end, for any reason."""

    PAUSE: ClassVar[float] = 1.0

    def __init__(self) -> None:
        self._task: asyncio.Task[None] | None = None

    def open(self) -> None:
        """Start to connect and reconnect, until `close`."""
        self._task = asyncio.get_running_loop().create_task(self._keep_connected())

    async def close(self) -> None:
        """Close the connection."""
        if self._task is not None:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)

    @abstractmethod
    async def connected(self) -> str:
        """Connect, and return when the connection fails or is lost: reason and remedy in one line."""

    @abstractmethod
    def failed(self, why: str) -> None:
        """Record the reason of the failure."""

    async def _keep_connected(self) -> None:
        logged = ""
        while True:
            try:
                why = await self.connected()
            except Exception as error:  # an error of any kind is reported, and does not end the attempts
                why = f"the connection failed: {error!r}"
                if why != logged:
                    logging.getLogger(GATEWAY.kind).exception("the connection to the tracker failed")
                logged = why
            self.failed(why)
            await asyncio.sleep(self.PAUSE)
