"""The problem of a NatNet connection without poses, and its remedy, in one line."""

from __future__ import annotations

from flockwire_mocap.natnet.packets import COMMAND_PORT, OLDEST, ServerInfo, Version
from flockwire_mocap.natnet.session import NatNetSession


def trouble(session: NatNetSession, command_port: int = COMMAND_PORT) -> str | None:
    """Return the problem of a session after its first second; None if frames with rigid bodies arrive."""
    if session.failure is not None:
        return f"{session.failure}: set the address of the interface that leads to the server"
    if session.frames:
        return None if session.empty < session.frames else _no_bodies(session)
    if session.counts["packets malformed"]:
        return _not_understood(session)
    if session.info is not None:
        return _no_frames(session, session.info)
    return _foreign(session) or _no_answer(session, command_port)


def _no_bodies(session: NatNetSession) -> str:
    return f"{session.options.server}: frames without rigid bodies: enable Rigid Bodies in Motive's streaming settings"


def _no_frames(session: NatNetSession, info: ServerInfo) -> str:
    server = session.options.server
    if info.version < OLDEST:
        return f"{server} streams NatNet {_text(info.version)}: {_text(OLDEST)} or newer is needed, update Motive"
    if info.multicast != session.options.multicast:
        return _other_mode(info, server)
    return _foreign(session) or _no_stream(info)


def _foreign(session: NatNetSession) -> str | None:
    if session.foreign is None:
        return None
    return f"packets come from {session.foreign}, not from {session.options.server}: set the server's address to it"


def _not_understood(session: NatNetSession) -> str:
    version, malformed = session.version, session.counts["packets malformed"]
    read_as = "before its version was known" if version is None else f"as NatNet {_text(version)}"
    return (
        f"{session.options.server}: {malformed} packets not understood {read_as} ({session.rejected}): "
        "set the bitstream version to the one that Motive streams"
    )


def _no_answer(session: NatNetSession, command_port: int) -> str:
    return (
        f"no answer from {session.options.server}:{command_port}: check its address and command port, that streaming "
        f"is enabled in Motive on that interface, and that a firewall lets UDP {command_port} through"
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
