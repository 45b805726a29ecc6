"""The rules of each Tello command, as data: time limit, replies, repetitions; and its replies, cut out of datagrams.

Sources: Tello SDK 1.3 (2018), SDK 2.0 (EDU, 2018), SDK 3.0 (RoboMaster TT, 2021) user guides for names and replies; the
times are larger than those in public logs (`command` 28 to 48 ms, `takeoff` 3.9 s, `land` 1.7 s).

Replies, from public logs: numbers end in CR LF, the reply to `ap` in NUL; a reply may share a datagram with another;
the first reply to `command` may be, or begin with, bytes that are not ASCII. Nothing here raises for data from the
network.
"""

from __future__ import annotations

import re
from typing import NamedTuple

OK = re.compile(r"(?:matrix |led )?ok\b.*", re.IGNORECASE)  # "OK,drone will reboot in 3s" is one too
ANY = re.compile(r".+")
NUMBER = r"-?\d+(?:\.\d+)?"


class CommandRule(NamedTuple):
    """How to treat one command; times in s."""

    timeout: float  # from sending to repetition or giving up
    resend: int  # allowed repetitions; 0 if a second one has another effect
    reply: re.Pattern[str] | None = OK  # pattern of a good reply; None: it has no reply
    late: float = 0.5  # time for a late reply after it ended without one
    urgent: bool = False  # replaces the command in flight and all that wait


def _query(pattern: str) -> CommandRule:
    return CommandRule(timeout=1.0, resend=2, reply=re.compile(pattern))


SILENT = CommandRule(timeout=0.0, resend=0, reply=None)
SETTING = CommandRule(timeout=2.0, resend=2)
MOVE = CommandRule(timeout=60.0, resend=0, late=1.0)  # 5 m at 10 cm/s take 50 s
UNKNOWN = CommandRule(timeout=7.0, resend=0, reply=ANY, late=2.0)

RULES: dict[str, CommandRule] = {
    "command": CommandRule(timeout=1.0, resend=4),
    "takeoff": CommandRule(timeout=20.0, resend=0, late=5.0),
    "throwfly": CommandRule(timeout=20.0, resend=0, late=5.0),
    "land": CommandRule(timeout=0.5, resend=5, late=5.0, urgent=True),  # a second one has no effect
    "stop": CommandRule(timeout=2.0, resend=2, reply=re.compile(r"ok|forced stop"), urgent=True),
    "rc": SILENT,
    "emergency": SILENT,
    **dict.fromkeys(("up", "down", "left", "right", "forward", "back", "cw", "ccw", "go", "curve", "jump"), MOVE),
    "flip": CommandRule(timeout=10.0, resend=0, late=1.0),
    **dict.fromkeys(("speed", "mon", "moff", "mdirection", "streamon", "streamoff", "port"), SETTING),
    **dict.fromkeys(("setfps", "setbitrate", "setresolution", "wifisetchannel", "downvision"), SETTING),
    **dict.fromkeys(("motoron", "motoroff", "keepalive"), SETTING),
    **dict.fromkeys(("wifi", "ap", "multiwifi", "reboot"), CommandRule(timeout=5.0, resend=0)),  # the drone restarts
    "EXT": CommandRule(
        timeout=2.0, resend=2, reply=re.compile(r"(?:matrix |led )?ok\b.*|tof \d+|esp32\S+", re.IGNORECASE)
    ),
    "battery?": _query(r"\d+"),
    "speed?": _query(NUMBER),
    "time?": _query(r"\d+s?"),
    "height?": _query(r"-?\d+dm"),
    "temp?": _query(r"-?\d+~-?\d+C"),
    "attitude?": _query(r"pitch:-?\d+;roll:-?\d+;yaw:-?\d+;"),
    "baro?": _query(NUMBER),
    "acceleration?": _query(rf"agx:{NUMBER};agy:{NUMBER};agz:{NUMBER};"),
    "tof?": _query(r"-?\d+mm"),
    "wifi?": _query(r"-?\d+"),
    "sdk?": _query(r"\d+(?:\.\d+)*"),
    "sn?": _query(r"[0-9A-Z]{6,}"),
    "hardware?": _query(r"[A-Z]+"),
    "wifiversion?": _query(r"wifiv.*"),
    **dict.fromkeys(("ap?", "ssid?"), _query(r".+")),
}


def word(command: str) -> str:
    """Return the name of a command: its first word."""
    return command.partition(" ")[0]


def rule(command: str) -> CommandRule:
    """Return the rule of a command, `UNKNOWN` where it is in no guide."""
    return RULES.get(word(command), UNKNOWN)


LONGEST = 2048  # bytes of a datagram, a longer one is not a reply
MOST = 16  # replies in a datagram, others are dropped
REFUSALS = ("error", "out of range", "unknown command", "command error")

_ENDS = re.compile(r"[\r\n\0]+")
_JUNK = re.compile(r"[^ -~]")


def split_replies(datagram: bytes) -> list[str]:
    """Return the replies in a datagram: printable ASCII after any invalid bytes, without ends of line."""
    if len(datagram) > LONGEST:
        return []
    pieces = _ENDS.split(datagram.decode("ascii", errors="replace"))
    replies = [_JUNK.split(piece)[-1].strip() for piece in pieces[:MOST]]
    return [reply for reply in replies if reply]


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
