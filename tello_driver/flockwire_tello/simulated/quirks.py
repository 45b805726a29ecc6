"""Undocumented behaviour of real Tellos, which can be switched on and off in the simulated one."""

from __future__ import annotations

from collections.abc import Iterable
from enum import StrEnum


class Quirk(StrEnum):
    """One behaviour of real drones; its `__doc__` describes it and names the source."""

    def __new__(cls, name: str, doc: str) -> Quirk:
        """Make a member that is the string `name`."""
        member = str.__new__(cls, name)
        member._value_ = name
        member.__doc__ = doc
        return member

    AUTO_LAND = "auto-land", "Without any command for 15 s it lands by itself (user guides, safety feature)."
    STICKS_STAY = (
        "sticks-stay",
        "A stick value stays until the next `rc`: when the stream stops it flies on. Off: centred after 0.5 s.",
    )
    NO_EMERGENCY_REPLY = "no-emergency-reply", "`emergency` gets no reply, unlike in the guides (seen on the EDU)."
    NOT_JOYSTICK = (
        "not-joystick",
        "Every third movement command is refused, `error Not joystick`, until it is repeated (DJITelloPy issue 201; "
        "when a real one does it is not known).",
    )
    NO_VALID_IMU = (
        "no-valid-imu",
        "Movement commands are refused, `error No valid imu`; `rc` works (DJITelloPy issues 42, 76: too little light).",
    )
    NOT_ACTIVATED = (
        "not-activated",
        "An EDU that was never activated by the maker's app: `takeoff` is refused, `error`.",
    )
    LOW_BATTERY = "low-battery", "The battery is at 8 %: `takeoff` is refused, `error`."
    SECOND_SESSION_HANGS = (
        "second-session-hangs",
        "From the second session on, replies come only to a client that is bound to port 8889; commands are obeyed all "
        "the same (EDU; DJITelloPy pull request 163).",
    )
    LOST_DATAGRAMS = "lost-datagrams", "A share of all datagrams is lost, in both directions."
    LATE_REPLIES = "late-replies", "Every fourth reply comes 1.5 s late."
    JUNK_BEFORE_FIRST_REPLY = (
        "junk-before-first-reply",
        "The first reply after power-on is preceded by a datagram of bytes that are not ASCII (ctello issue 7): who "
        "takes it for the reply takes each reply for the next command's.",
    )
    JUNK_IN_FIRST_REPLY = "junk-in-first-reply", "The first reply after power-on begins with bytes that are not ASCII."


USUAL = frozenset({Quirk.AUTO_LAND, Quirk.STICKS_STAY, Quirk.NO_EMERGENCY_REPLY})  # of every real one


def switched(names: Iterable[str]) -> frozenset[Quirk]:
    """Return the usual quirks with those in `names` switched on, and those named `no-NAME` off.

    Raises ValueError with the known names where one is unknown.
    """
    found = set(USUAL)
    for name in names:
        if name in _BY_NAME:
            found.add(_BY_NAME[name])
        elif name.startswith("no-") and name[3:] in _BY_NAME:
            found.discard(_BY_NAME[name[3:]])
        else:
            raise ValueError(f"{name!r}: must be one of {', '.join(_BY_NAME)}; or no-NAME to switch it off")
    return frozenset(found)


_BY_NAME = {quirk.value: quirk for quirk in Quirk}
