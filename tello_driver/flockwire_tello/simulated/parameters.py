"""The parameters of a simulated Tello. No manual has most of them; assumptions are marked."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from flockwire.domain.vector import Vector

from flockwire_tello.simulated.quirks import USUAL, Quirk
from flockwire_tello.sticks import StickGains

Generation = Literal["1.3", "2.0", "3.0"]


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
    serial: str = "0TQZSIMULATED0"

    def __post_init__(self) -> None:
        """Raise ValueError if a number is out of range."""
        for name in ("lag", "yaw_lag", "dead_time", "drag"):
            if not getattr(self, name) >= 0.0:
                raise ValueError(f"{name} = {getattr(self, name)}: must be 0 or more")
        if not 0.0 <= self.loss <= 1.0:
            raise ValueError(f"loss = {self.loss}: must be from 0 to 1")
