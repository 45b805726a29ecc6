"""Vicon as a source of the gateway, by the package `motioncapture`, in a child process.

    python -P -m flockwire_mocap.vicon SERVER

The child connects, waits for frames, and writes each as a line of JSON: [arrival, {name: [x, y, z, qx, qy, qz, qw]}].
The arrival is in ns of the monotonic clock, read there, so that it includes the time in the pipe. A line of text is an
error of the package.

It is a separate process because the package's connect, without a server, neither returns nor releases the interpreter.
"""

from __future__ import annotations

import asyncio
import contextlib
import importlib.util
import json
import sys
from collections.abc import Callable
from math import isfinite
from typing import Any

from flockwire_core import clock
from flockwire_core.process.cores import Start

from flockwire_mocap.persistent import PersistentConnection, imported
from flockwire_mocap.streamed import StreamedSource
from flockwire_mocap.tracking import ReportedBody, TrackerFrame, is_pose

MOST_BODIES = 1000
FRAME_TIMEOUT = 2.5  # s without a frame after which the child is killed and restarted


class ViconSource(StreamedSource):
    """The bodies that a Vicon server reports; `child` is the child's last line that is not a frame: an error."""

    def __init__(self, start: Start) -> None:
        gateway = start.plan.swarm.gateway
        self.table = gateway.vicon
        self.child = ""
        self._numbers: dict[str, int] = {}
        self._lines = 0
        super().__init__(gateway, f"waits for {self.table.server}", self.table.latency)

    def line(self, line: bytes, now: int) -> None:
        """Receive a line of the child, read at `now` (Unix ns): a frame or a text."""
        try:
            frame = json.loads(line)
            if isinstance(frame, str):
                self.child = frame
                return
            came, rows = frame
            if type(came) is not int or not 0 <= came < 1 << 62:  # ns of a monotonic clock: 146 years
                raise ValueError(came)
            bodies = tuple(self._body(str(name), [float(v) for v in row]) for name, row in rows.items())
        except (ValueError, AttributeError, TypeError):
            self.counts["lines malformed"] += 1
            return
        self._lines += 1
        self.failure = ""
        self.arrived(TrackerFrame(self._lines, came, came, bodies), now)

    def _body(self, name: str, row: list[float]) -> ReportedBody:
        x, y, z, qx, qy, qz, qw = row
        if name not in self._numbers and len(self._numbers) >= MOST_BODIES:
            raise ValueError(name)
        number = self._numbers.setdefault(name, len(self._numbers))
        tracked = is_pose((x, y, z), (qx, qy, qz, qw))
        self.counts["poses rejected"] += not tracked and isfinite(x)  # a body that is not seen has no numbers
        return ReportedBody(number, name, (x, y, z), (qx, qy, qz, qw), tracked)


class ViconClient(PersistentConnection[ViconSource]):
    """Feeds a source with the lines of its child, which it restarts when that ends or hangs.

    Raises OSError if motioncapture is not installed.
    """

    PAUSE = 0.3  # s between two children

    def __init__(self, source: ViconSource, drained: Callable[[], None], command: list[str] | None = None) -> None:
        if command is None and importlib.util.find_spec("motioncapture") is None:
            imported("motioncapture", "vicon")
        super().__init__(source, drained)
        self._command = command or [sys.executable, "-P", "-m", __name__, source.table.server]

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


def row(body: Any) -> list[float]:  # noqa: ANN401  (the package has no types)
    """Return position and quaternion x y z w of a body of the package."""
    turn = body.rotation
    return [*map(float, body.position), turn.x, turn.y, turn.z, turn.w]


def main() -> int:
    """Write frames until the parent is gone: this is the child."""
    try:
        package = imported("motioncapture", "vicon")
        system = package.connect("vicon", {"hostname": sys.argv[1]})
        while True:
            system.waitForNextFrame()
            came = clock.monotonic()
            print(json.dumps([came, {name: row(body) for name, body in system.rigidBodies.items()}]), flush=True)
    except BrokenPipeError:
        return 0
    except (OSError, RuntimeError) as error:
        print(json.dumps(str(error)), flush=True)
        return 1


if __name__ == "__main__":
    sys.exit(main())
