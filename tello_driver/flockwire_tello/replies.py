"""Replies of a Tello: cut out of datagrams, distinguished, and read as numbers in SI units.

From public logs: numbers end in CR LF, the reply to `ap` in NUL; a reply may share a datagram with another; the first
reply to `command` may be, or begin with, bytes that are not ASCII. Nothing here raises for data from the network.
"""

from __future__ import annotations

import re
from math import pi

from flockwire_tello.commands import NUMBER, rule, word

LONGEST = 2048  # bytes of a datagram, a longer one is not a reply
MOST = 16  # replies in a datagram, others are dropped
REFUSALS = ("error", "out of range", "unknown command", "command error")
STANDARD_GRAVITY = 9.80665  # m/s^2

_ENDS = re.compile(r"[\r\n\0]+")
_AFTER_JUNK = re.compile(r"[ -~]*\Z")
_NUMBERS = re.compile(NUMBER)
_UNITS = {  # of one count, in SI units
    "battery?": 0.01,
    "speed?": 0.01,
    "time?": 1.0,
    "height?": 0.1,
    "temp?": 1.0,
    "attitude?": pi / 180.0,
    "baro?": 1.0,
    "acceleration?": STANDARD_GRAVITY / 1000.0,
    "tof?": 0.001,
    "wifi?": 1.0,
}


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


def readings(query: str, reply: str) -> tuple[float, ...]:
    """Return the numbers in the reply to a query, in SI units.

    Battery as a share, speed in m/s, height, baro and tof in m, temperature (lowest, highest) in degrees C, attitude
    (pitch, roll, yaw; yaw clockwise) in rad, acceleration in m/s^2. Empty if the reply does not fit the query.
    """
    unit = _UNITS.get(word(query))
    if unit is None or refused(reply) or not fits(query, reply):
        return ()
    text = reply.replace("~", " ") if "~" in reply else reply
    return tuple(float(number) * unit for number in _NUMBERS.findall(text))


def _printable(piece: str) -> str:
    found = _AFTER_JUNK.search(piece)
    return found.group().strip() if found else ""
