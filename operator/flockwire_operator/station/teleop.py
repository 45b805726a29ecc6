"""`flockwire teleop`: steers a teleoperated leader by a gamepad, and by the keys of a terminal.

A key acts for HELD s: a pressed key (which repeats) moves the leader, a released key stops it.
"""

from __future__ import annotations

import asyncio
import contextlib
from pathlib import Path

from flockwire_core import clock
from flockwire_core.domain.airframe import Steer
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import ZERO, Vector, add, limit, scale
from flockwire_core.runtime.swarm_clock import SwarmClock
from flockwire_core.swarm.model import Swarm, uav
from flockwire_core.wire.keys import STEERING, Key
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.processes import TELEOP

from flockwire_operator.station.connecting import connected
from flockwire_operator.station.terminal.gamepad import Gamepad
from flockwire_operator.station.terminal.interrupts import interrupts
from flockwire_operator.station.terminal.keyboard import keys_pressed

HELD = 0.6 * SECOND  # ns: longer than a keyboard waits before it repeats a key
WAYS: dict[str, Vector] = {
    "d": (1.0, 0.0, 0.0), "a": (-1.0, 0.0, 0.0), "w": (0.0, 1.0, 0.0), "s": (0.0, -1.0, 0.0),
    "r": (0.0, 0.0, 1.0), "f": (0.0, 0.0, -1.0),
}  # fmt: skip
STICKS = "left stick north, south, east, west; right stick up, down"
HINT = "w a s d north, west, south, east; r f up, down; space stops; q ends"


class SteeringKeys:
    """Turns keys into a velocity of at most `speed` m/s, world frame."""

    def __init__(self, speed: float) -> None:
        self._speed = speed
        self._until: dict[str, float] = {}  # when a key stops acting, ns of a clock that does not go back
        self.ended = False

    def press(self, key: str, now: int) -> None:
        """Handle a key pressed at `now` (ns)."""
        if key in WAYS:
            self._until[key] = now + HELD
        elif key == " ":
            self._until.clear()
        elif key == "q":
            self.ended = True

    def velocity(self, now: int) -> Vector:
        """Return the velocity to command at `now` (ns)."""
        total = ZERO
        for key, until in self._until.items():
            if now < until:
                total = add(total, WAYS[key])
        return limit(scale(total, self._speed), self._speed)


def steered(swarm: Swarm) -> tuple[tuple[int, ...], float]:
    """Return the leaders that a person steers, all alike, and their speed, m/s: the lowest of their maxima."""
    led = tuple(i for i, leader in swarm.leading.items() if leader.kind == "teleoperated")
    return led, min((swarm.leading[i].speed for i in led), default=0.0)


async def steer(plan: Plan, keys: Path, gamepad: Gamepad | None = None) -> bool:
    """Publish steering commands until `q` or an interrupt; returns False if it could not. Raises CredentialsError.

    A moved stick overrides the keys.
    """
    period = 0.05  # s between two commands
    led, speed = steered(plan.swarm)
    pressed, keys_led = SteeringKeys(speed), [Key(STEERING, uav(number)) for number in led]
    with interrupts() as interrupted:
        session = await connected(plan, TELEOP.kind, keys, interrupted)
        if session is None:
            return False
        followed = gamepad.followed() if gamepad is not None else contextlib.nullcontext()
        with session, keys_pressed(pressed.press), followed:
            swarm_clock = SwarmClock(plan, TELEOP.kind, session)
            if gamepad is not None:
                print(f"flockwire: {gamepad.name}: {STICKS}", flush=True)
            print(f"flockwire: {HINT}", flush=True)
            while not (pressed.ended or interrupted.count):
                swarm_clock.step()
                now = clock.monotonic()
                velocity = gamepad.velocity(now) if gamepad is not None else ZERO
                velocity = velocity if velocity != ZERO else pressed.velocity(now)
                command = Steer(clock.now(), plan.swarm.frame, velocity)
                session.publish([(key, command) for key in keys_led])
                await asyncio.sleep(period)
    return True
