"""The processes of one host, as children that never outlive their parent."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import os
import signal
import socket
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path

from flockwire.config import Swarm
from flockwire.detours import detour_environment
from flockwire.runtime import LIFELINE
from flockwire.wiring import endpoints

FAULTY = ("gateway", "kinematics")  # they let the faults of the tracker and the airframes happen
GRACE = 2.5  # s between being told to end and being killed


class PortInUseError(OSError):
    """A process of the swarm cannot listen where it should."""


def command(identity: str, swarm_file: Path, out: Path, keys: Path, faults: Path | None = None) -> list[str]:
    """Return the command line that runs `identity`; `faults` goes to those that let faults happen themselves."""
    base = [sys.executable, "-m", "flockwire_cli"]
    extra = ["--out", str(out)] if identity == "recorder" else []
    if faults is not None and identity in FAULTY:
        extra = ["--faults", str(faults)]
    if identity.startswith("uav"):
        verb, number = "agent", [identity.removeprefix("uav")]
    else:
        verb, number = identity, []
    return [*base, verb, str(swarm_file), *number, "--keys", str(keys), *extra]


def busy_endpoint(swarm: Swarm, identities: Iterable[str]) -> str:
    """Return a line about the first of the endpoints that cannot be listened at, empty when all can."""
    for identity in (identity for identity in identities if identity in endpoints(swarm)):
        address, _, port = endpoints(swarm)[identity].rpartition(":")
        family = socket.AF_INET6 if address.startswith("[") else socket.AF_INET
        with socket.socket(family, socket.SOCK_STREAM) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                probe.bind((address.strip("[]"), int(port)))
            except OSError as error:
                reason = "is in use" if error.errno == errno.EADDRINUSE else str(error.strerror).lower()
                return (
                    f"network.base_port = {swarm.network.base_port}: {identity} listens at {address}:{port}, which "
                    f"{reason}; end what runs there or choose another base_port"
                )
    return ""


class Children:
    """The running processes, by identity. Their standard error goes to `out`/logs/IDENTITY.log.

    `detours` has by identity, for those whose links have relays, where they dial whom.
    """

    def __init__(
        self,
        swarm_file: Path,
        out: Path,
        keys: Path,
        faults: Path | None = None,
        detours: Mapping[str, Mapping[str, str]] | None = None,
    ) -> None:
        self._swarm_file, self._out, self._keys, self._faults = swarm_file, out, keys, faults
        self._detours = detours or {}
        self._running: dict[str, asyncio.subprocess.Process] = {}
        self._doomed: set[str] = set()
        self._read_end, self._write_end = os.pipe()
        (out / "logs").mkdir(parents=True, exist_ok=True)

    async def start(self, identity: str) -> None:
        """Start the process of `identity`."""
        detours = detour_environment(self._detours.get(identity, {}))
        with self.log(identity).open("ab") as log:
            self._running[identity] = await asyncio.create_subprocess_exec(
                *command(identity, self._swarm_file, self._out, self._keys, self._faults),
                stdin=asyncio.subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                pass_fds=(self._read_end,),
                env={**os.environ, LIFELINE: str(self._read_end), **detours},
                start_new_session=True,  # the terminal's Ctrl-C is ours to handle
            )

    def signal(self, identity: str, number: int) -> None:
        """Send a signal to the process of `identity`, if there is one."""
        process = self._running.get(identity)
        if process is not None and process.returncode is None:
            process.send_signal(number)

    def kill(self, identity: str) -> None:
        """End the process of `identity` at once; that is then no accident."""
        self._doomed.add(identity)
        self.signal(identity, signal.SIGKILL)

    async def restart(self, identity: str) -> None:
        """Kill the process of `identity`, if it runs, and start it anew."""
        self.kill(identity)
        if identity in self._running:
            await self._running[identity].wait()
        await self.start(identity)
        self._doomed.discard(identity)

    def log(self, identity: str) -> Path:
        """Return where the process of `identity` logs."""
        return self._out / "logs" / f"{identity}.log"

    def died(self) -> str:
        """Return a line about a process that ended by itself, empty when all run."""
        for identity, process in self._running.items():
            if process.returncode is not None and identity not in self._doomed:
                lines = self.log(identity).read_text(errors="replace").strip().splitlines()
                how = _how(process.returncode)
                return f"{identity} ended by itself ({how}){': ' + lines[-1] if lines else ''}"
        return ""

    async def end(self) -> None:
        """End all processes, the recorder last, and wait for them; kill what does not end in time."""
        order = sorted(self._running, key=lambda identity: identity == "recorder")
        for group in (order[:-1], order[-1:]) if "recorder" in self._running else (order,):
            await asyncio.gather(*(self._end(self._running[identity]) for identity in group))
        self._running.clear()
        for fd in (self._read_end, self._write_end):
            with contextlib.suppress(OSError):
                os.close(fd)

    async def _end(self, process: asyncio.subprocess.Process) -> None:
        with contextlib.suppress(ProcessLookupError):
            process.send_signal(signal.SIGCONT)  # one that stands still would not hear the other
            process.terminate()
        try:
            await asyncio.wait_for(process.wait(), GRACE)
        except TimeoutError:
            with contextlib.suppress(ProcessLookupError):
                process.kill()
            await process.wait()


def _how(status: int) -> str:
    return f"signal {signal.Signals(-status).name}" if status < 0 else f"exit status {status}"
