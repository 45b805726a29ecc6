"""The parameters of a simulated Tello, and undocumented behaviour of real ones, which can be switched on and off.

No manual has most of the parameters; assumptions are marked.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Literal

from flockwire_core.domain.vector import Vector
from flockwire_tello.swarm_file import StickGains

Generation = Literal["1.3", "2.0", "3.0"]


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


@dataclass(frozen=True)
class TelloParameters:
    """One simulated Tello. Lengths m, times s, angles rad."""

    generation: Generation = "2.0"  # of the SDK: Tello, Tello EDU, RoboMaster TT
    position: Vector = (0.0, 0.0, 0.0)  # world frame ENU, its start
    yaw: float = 0.0  # counter-clockwise from world x
    gains: StickGains = field(default_factory=StickGains)
    lag: float = 0.25  # of velocity behind its command (assumption)
    yaw_lag: float = 0.15  # (assumption)
    dead_time: float = 0.10  # (assumption)
    drag: float = 0.5  # 1/s, deceleration per speed: it tilts to keep flying (assumption)
    quirks: frozenset[Quirk] = USUAL
    loss: float = 0.05  # share of datagrams, of the quirk LOST_DATAGRAMS
    state_port: int = 8890
    battery: float = 1.0  # share, at power-on
    endurance: float = 780.0  # of flight on a full battery (data sheet: 13 min)
    idle_endurance: float = 4800.0  # on the ground (assumption)
    reply_time: tuple[float, float] = (0.028, 0.048)  # public logs
    takeoff_height: float = 1.0
    takeoff_time: float = 3.9  # until the reply (public logs)
    sink: float = 0.7  # m/s, of landing: 1.7 s from the take-off height (public logs)
    serial: str = "0TQZSIMULATED0"  # distinct in a swarm and on a host: clients know drones by it

    def __post_init__(self) -> None:
        for name in ("lag", "yaw_lag", "dead_time", "drag"):
            if not getattr(self, name) >= 0.0:
                raise ValueError(f"{name} = {getattr(self, name)}: must be 0 or more")
        if not 0.0 <= self.loss <= 1.0:
            raise ValueError(f"loss = {self.loss}: must be from 0 to 1")
