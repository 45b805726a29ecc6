"""Steers a teleoperated leader in virtual time by a script."""

from __future__ import annotations

from collections.abc import Callable

from flockwire.control.graph import LEADER
from flockwire.domain.airframe import Command
from flockwire.domain.vector import Vector
from flockwire.process.cores import Ground
from flockwire.swarm.model import uav
from flockwire.wire.codec import Message
from flockwire.wire.keys import STEERING, Key
from flockwire.wire.phase import Phase
from flockwire.wire.status import Report

Script = Callable[[int], Vector | None]  # the velocity to command at a time (Unix ns), m/s; None: nothing is sent


class ScriptedSteering(Ground):
    """Publishes the commands of `script`, twenty times a second."""

    period = 0.05

    def __init__(self, frame: str, script: Script) -> None:
        super().__init__()
        self._frame, self._script = frame, script

    def step(self, now: int) -> list[tuple[Key, Message]]:
        """Publish the current velocity."""
        velocity = self._script(now)
        return [] if velocity is None else [(Key(STEERING, uav(LEADER)), Command(now, self._frame, velocity))]

    def report(self, now: int) -> Report:
        """Return that it steers."""
        return Report(Phase.STEERING)


def nobody(_: int) -> Vector | None:
    """Do not steer."""
    return None
