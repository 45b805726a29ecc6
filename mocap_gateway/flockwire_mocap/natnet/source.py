"""NatNet as a source of the gateway, and the problem of a connection without poses, with its remedy."""

from __future__ import annotations

from flockwire_core.domain.time import SECOND
from flockwire_core.process.cores import Start

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
    server = session.table.server
    if session.failure is not None:
        return f"{session.failure}: set the address of the interface that leads to the server"
    if 0 < session.frames == session.empty:
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
    server, port = session.table.server, session.table.command_port
    return _foreign(session) or (
        f"no answer from {server}:{port}: check its address and command port, that streaming is enabled in Motive on "
        f"that interface, and that a firewall lets UDP {port} through"
    )


def _not_understood(session: NatNetSession) -> str:
    version, malformed = session.version, session.counts["packets malformed"]
    read_as = "before its version was known" if version is None else f"as NatNet {_text(version)}"
    return (
        f"{session.table.server}: {malformed} packets not understood {read_as} ({session.rejected}): "
        "set the bitstream version to the one that Motive streams"
    )


def _answers_only(session: NatNetSession, info: ServerInfo) -> str:
    server, group = session.table.server, f"{info.group}:{info.data_port}"
    if info.version < OLDEST:
        return f"{server} streams NatNet {_text(info.version)}: {_text(OLDEST)} or newer is needed, update Motive"
    if info.multicast and not session.table.multicast:
        return f"{server} streams to the multicast group {group}: set multicast = true"
    if session.table.multicast and not info.multicast:
        return f"{server} streams in unicast: set multicast = false"
    if info.multicast:
        why = (
            f"but nothing comes to {group}: check the interface that joins the group, and that a firewall lets UDP "
            f"{info.data_port} through"
        )
    else:
        why = "but streams nothing: start live mode or playback, and enable rigid bodies"
    return _foreign(session) or f"{info.name} answers, {why}"


def _foreign(session: NatNetSession) -> str:
    if session.foreign is None:
        return ""
    return f"packets come from {session.foreign}, not from {session.table.server}: set the server's address to it"


def _text(version: Version) -> str:
    return "{}.{}".format(*version)
