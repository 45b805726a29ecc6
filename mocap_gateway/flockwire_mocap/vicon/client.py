"""Runs the child process of the Vicon source; restarts it when it ends or hangs."""

from __future__ import annotations

import asyncio
import contextlib
import importlib.util
import sys
from collections.abc import Callable

from flockwire_core import clock

from flockwire_mocap.persistent import PersistentConnection, imported
from flockwire_mocap.vicon.source import ViconSource

FRAME_TIMEOUT = 2.5  # s without a frame after which the child is killed and restarted
CHILD = "flockwire_mocap.vicon.child"


class ViconClient(PersistentConnection[ViconSource]):
    """Feeds a source with the lines of its child.

    Raises OSError if motioncapture is not installed.
    """

    PAUSE = 0.3  # s between two children

    def __init__(self, source: ViconSource, drained: Callable[[], None], command: list[str] | None = None) -> None:
        if command is None and importlib.util.find_spec("motioncapture") is None:
            imported("motioncapture", "vicon")
        super().__init__(source, drained)
        self._command = command or [sys.executable, "-P", "-m", CHILD, source.table.server]

    async def connected(self) -> str:
        """Run a child until it ends or hangs; returns the reason."""
        # bytes: a frame of MOST_BODIES with long names is a quarter of that
        child = await asyncio.create_subprocess_exec(*self._command, stdout=asyncio.subprocess.PIPE, limit=1 << 20)
        try:
            return await self._listen(child)
        finally:
            with contextlib.suppress(ProcessLookupError):
                child.kill()  # other signals do not reach it while it connects
            await child.wait()

    async def _listen(self, child: asyncio.subprocess.Process) -> str:
        assert child.stdout is not None  # noqa: S101  (it is a pipe)
        server = self.source.table.server
        while True:
            try:
                async with asyncio.timeout(FRAME_TIMEOUT):  # `wait_for` can lose a cancellation before Python 3.12
                    line = await child.stdout.readline()
            except TimeoutError:
                return f"{server} sends nothing: check its address, and that Tracker or Nexus is live"
            if not line:
                return f"{server}: {self.source.child or 'the client has ended'}"
            self.source.line(line, clock.now())
            self._drained()
