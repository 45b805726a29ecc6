"""NatNet as a source of the gateway."""

from __future__ import annotations

from flockwire.domain.time import SECOND
from flockwire.process.cores import Start
from flockwire.swarm.gateway import NatNet

from flockwire_mocap.natnet.packets import Version
from flockwire_mocap.natnet.session import NatNetSession, Options
from flockwire_mocap.natnet.trouble import trouble
from flockwire_mocap.streamed import StreamedSource, coordinates_of

FIRST_ANSWER = SECOND  # ns without an answer after which a server is reported as silent


class NatNetSource(StreamedSource):
    """The bodies that a NatNet server streams. `session` takes the server's datagrams in, `arrived` the frames."""

    def __init__(self, start: Start) -> None:
        gateway = start.plan.swarm.gateway
        self.table = gateway.natnet
        self.session = NatNetSession(_options(self.table))
        self._began = start.now
        super().__init__(coordinates_of(gateway), self._missing, self.session.counts)

    def _missing(self, now: int) -> str:
        if now - self._began < FIRST_ANSWER and not self.session.frames:
            return f"waits for {self.table.server}"
        return trouble(self.session, self.table.command_port) or ""


def _options(table: NatNet) -> Options:
    return Options(table.server, table.multicast, version_of(table.bitstream), table.request_model)


def version_of(text: str | None) -> Version | None:
    """Return a version that is written as "4.1"."""
    if text is None:
        return None
    major, _, minor = text.partition(".")
    return int(major), int(minor)
