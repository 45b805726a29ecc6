"""Replies of a Tello: cut out of datagrams, and distinguished.

From public logs: numbers end in CR LF, the reply to `ap` in NUL; a reply may share a datagram with another; the first
reply to `command` may be, or begin with, bytes that are not ASCII. Nothing here raises for data from the network.
"""

from __future__ import annotations

import re

from flockwire_tello.commands import rule

LONGEST = 2048  # bytes of a datagram, a longer one is not a reply
MOST = 16  # replies in a datagram, others are dropped
REFUSALS = ("error", "out of range", "unknown command", "command error")

_ENDS = re.compile(r"[\r\n\0]+")
_AFTER_JUNK = re.compile(r"[ -~]*\Z")


def split_replies(datagram: bytes) -> list[str]:
    """Return the replies in a datagram: printable ASCII after any invalid bytes, without ends of line."""
    if len(datagram) > LONGEST:
        return []
    pieces = _ENDS.split(datagram.decode("ascii", errors="replace"))
    return [reply for piece in pieces[:MOST] if (reply := _printable(piece))]


def refused(reply: str) -> bool:
    """Return whether a reply is a refusal."""
    return reply.startswith(REFUSALS)


def fits(command: str, reply: str) -> bool:
    """Return whether `reply` can be the one to `command`: a good one, or a refusal of it."""
    wanted = rule(command).reply
    if wanted is None:
        return False
    if reply.startswith("unknown command"):
        name = reply.partition(":")[2].strip()
        return not name or command.startswith(name)
    return refused(reply) or wanted.fullmatch(reply) is not None


def _printable(piece: str) -> str:
    found = _AFTER_JUNK.search(piece)
    return found.group().strip() if found else ""
