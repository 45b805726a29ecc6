"""NatNet as a source of the gateway, and the problem of a connection without poses, with its remedy."""

from __future__ import annotations

from flockwire_core.domain.time import SECOND
from flockwire_core.process.cores import Start
from flockwire_core.swarm.gateway import NatNet

from flockwire_mocap.natnet.packets import OLDEST, ServerInfo, Version
from flockwire_mocap.natnet.session import NatNetSession
from flockwire_mocap.streamed import StreamedSource

FIRST_ANSWER = SECOND  # ns without an answer after which a server is reported as silent


class NatNetSource(StreamedSource):
    """The bodies that a NatNet server streams. `session` takes the server's datagrams in, `arrived` the frames."""

    def __init__(self, start: Start) -> None:
        swarm = start.plan.swarm
        bodies = (*map(swarm.body, swarm.tracked), *(one.body for one in swarm.tracked_obstacles))
        self.session = NatNetSession(swarm.gateway.natnet, [body for body in bodies if isinstance(body, str)])
        self._began = start.now
        super().__init__(swarm.gateway)
        self.counts = self.session.counts

    def trouble(self, now: int) -> str:
        """Return why there are no frames at `now` (Unix ns), and the remedy; empty while they arrive."""
        if now - self._began < FIRST_ANSWER and not self.session.frames:
            return f"waits for {self.session.table.server}"
        return trouble(self.session, now) or ""


def trouble(session: NatNetSession, now: int) -> str | None:
    """Return the problem of a session at `now` (ns), after its first second; None if frames arrive or just ended."""
    if session.failure is not None:
        return f"{session.failure}: set the address of the interface that leads to the server"
    if 0 < session.frames == session.empty:
        server = session.table.server
        return f"{server}: frames without rigid bodies: enable Rigid Bodies in Motive's streaming settings"
    if session.frames and now - session.framed_at <= SECOND:
        return None
    return _no_frames(session, now)


def _no_frames(session: NatNetSession, now: int) -> str | None:
    if session.rejected is not None:
        return _not_understood(session)
    if session.info is not None and session.answers(now):
        return _answers_only(session, session.info)
    if session.frames and not session.silent(now):
        return None
    return _foreign(session) or _no_answer(session.table)


def _answers_only(session: NatNetSession, info: ServerInfo) -> str:
    server = session.table.server
    if info.version < OLDEST:
        return f"{server} streams NatNet {_text(info.version)}: {_text(OLDEST)} or newer is needed, update Motive"
    if info.multicast != session.table.multicast:
        return _other_mode(info, server)
    return _foreign(session) or _no_stream(info)


def _foreign(session: NatNetSession) -> str | None:
    if session.foreign is None:
        return None
    return f"packets come from {session.foreign}, not from {session.table.server}: set the server's address to it"


def _not_understood(session: NatNetSession) -> str:
    version, malformed = session.version, session.counts["packets malformed"]
    read_as = "before its version was known" if version is None else f"as NatNet {_text(version)}"
    return (
        f"{session.table.server}: {malformed} packets not understood {read_as} ({session.rejected}): "
        "set the bitstream version to the one that Motive streams"
    )


def _no_answer(table: NatNet) -> str:
    return (
        f"no answer from {table.server}:{table.command_port}: check its address and command port, that streaming "
        f"is enabled in Motive on that interface, and that a firewall lets UDP {table.command_port} through"
    )


def _other_mode(info: ServerInfo, server: str) -> str:
    if info.multicast:
        return f"{server} streams to the multicast group {info.group}:{info.data_port}: set multicast = true"
    return f"{server} streams in unicast: set multicast = false"


def _no_stream(info: ServerInfo) -> str:
    if info.multicast:
        return (
            f"{info.name} answers, but nothing comes to {info.group}:{info.data_port}: check the interface that joins "
            f"the group, and that a firewall lets UDP {info.data_port} through"
        )
    return f"{info.name} answers, but streams nothing: start live mode or playback, and enable rigid bodies"


def _text(version: Version) -> str:
    return f"{version[0]}.{version[1]}"
