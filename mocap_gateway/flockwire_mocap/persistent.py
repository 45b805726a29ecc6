"""A connection that is kept: made again whenever it is lost, until it is closed."""

from __future__ import annotations

import asyncio
from abc import ABC, abstractmethod
from typing import ClassVar


class PersistentConnection(ABC):
    """Connects, and `PAUSE` s after each end again."""

    PAUSE: ClassVar[float] = 1.0

    def __init__(self) -> None:
        self._task: asyncio.Task[None] | None = None

    def open(self) -> None:
        """Begin to connect, and keep at it until `close`."""
        self._task = asyncio.get_running_loop().create_task(self._keep_connected())

    async def close(self) -> None:
        """Close the connection."""
        if self._task is not None:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)

    @abstractmethod
    async def connected(self) -> None:
        """Connect, and return when the connection is lost, or there is none."""

    async def _keep_connected(self) -> None:
        while True:
            await self.connected()
            await asyncio.sleep(self.PAUSE)
