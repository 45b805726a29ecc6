"""Notices that the other end of a TCP connection is gone without notice: a host without power, a pulled cable."""

from __future__ import annotations

import asyncio
import socket

SILENCE = 3  # s without a sign of the other end, after which the connection is lost


def keep_alive(transport: asyncio.BaseTransport) -> None:
    """Have the kernel probe the other end every second while nothing comes, and end the connection after SILENCE s.

    The other end's kernel answers the probes, so that a server which sees no body, and has nothing to report, keeps its
    connection. A time-out for data could not distinguish that from a server that is gone.
    """
    link = transport.get_extra_info("socket")
    link.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    options = {
        "TCP_KEEPIDLE": 1,  # s
        "TCP_KEEPALIVE": 1,  # s: what macOS calls it
        "TCP_KEEPINTVL": 1,  # s
        "TCP_KEEPCNT": SILENCE,
        "TCP_USER_TIMEOUT": 1000 * SILENCE,  # ms; while own data is unanswered nothing is probed
    }
    for name, value in options.items():
        if hasattr(socket, name):
            link.setsockopt(socket.IPPROTO_TCP, getattr(socket, name), value)
