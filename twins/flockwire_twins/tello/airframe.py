"""The airframe of a simulated Tello: velocity behind lag and dead time in its own frame, yaw, ground, tilt.

    lag v' + v = R(yaw) u(t − dead_time) + w(t),   yaw_lag omega' + omega = omega_u(t − dead_time)

Both are solved exactly over steps of at most STEP, with the heading of the step's middle and the wind w of its begin.
The steps have a fixed grid and end where a command takes effect: the flight does not depend on the rate of calls.
"""

from __future__ import annotations

from collections import deque
from dataclasses import replace
from math import atan2, cos, pi, sin
from typing import NamedTuple

from flockwire_core.control.airframe.first_order_lag import lagged, lagged_motion
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.domain.vector import ZERO, Vector, add, scale
from flockwire_core.process.driving import GRAVITY
from flockwire_tello.sticks import to_body, to_world

from flockwire_twins.tello.parameters import TelloParameters
from flockwire_twins.wind import Wind

STEP = SECOND // 200


class AirframeMotion(NamedTuple):
    """Position and motion of an airframe, world frame ENU."""

    position: Vector  # m
    velocity: Vector  # m/s
    yaw: float  # rad, counter-clockwise from x, not wrapped
    yaw_rate: float  # rad/s
    acceleration: Vector  # m/s^2, of the airframe; gravity is not in it


class Attitude(NamedTuple):
    """An airframe's tilt and accelerometer."""

    pitch: float  # rad, nose up
    roll: float  # rad, right side down
    specific_force: Vector  # m/s^2, forward, right, down: at rest (0, 0, −g)


class TelloAirframe:
    """The body of one Tello, on the ground at `now` (ns), motors off."""

    def __init__(self, parameters: TelloParameters, now: int) -> None:
        self.motors = False
        self._held = False  # in a hand
        self._wind: Wind | None = None  # None: calm
        self._parameters, self._moment = parameters, now
        self._motion = AirframeMotion(parameters.position, ZERO, parameters.yaw, 0.0, ZERO)
        self._ground = parameters.position[2]
        self._input: tuple[Vector, float] = (ZERO, 0.0)
        self._coming: deque[tuple[int, Vector, float]] = deque()  # effective time, velocity, yaw rate

    @property
    def height(self) -> float:
        """Height above its start, m."""
        return self._motion.position[2] - self._ground

    @property
    def standing(self) -> bool:
        """Whether it is on the ground and does not climb."""
        return self.height <= 0.0 and self._motion.velocity[2] <= 0.0

    def command(self, velocity: Vector, yaw_rate: float, now: int) -> None:
        """Command a body velocity (FLU, m/s) and a yaw rate (rad/s, ccw) at `now`."""
        due = now + nanoseconds(self._parameters.dead_time)
        if self._coming and self._coming[-1][0] == due:
            self._coming.pop()
        self._coming.append((due, velocity, yaw_rate))

    def respond(self, lag: float, dead_time: float) -> None:
        """Set lag and dead time, s."""
        self._parameters = replace(self._parameters, lag=lag, dead_time=dead_time)

    def blow(self, wind: Wind) -> None:
        """Set the wind w; a calm one is none."""
        self._wind = wind if wind.blows else None

    def hold(self, height: float, now: int) -> None:
        """Hold it in a hand at `height` m above its start, motors off; put it down at 0."""
        self._commit(now)
        x, y, _ = self._motion.position
        self._held = height > 0.0
        self._motion = AirframeMotion((x, y, self._ground + height), ZERO, self._motion.yaw, 0.0, ZERO)

    def start(self, now: int) -> None:
        """Turn the motors on at `now`."""
        self._commit(now)
        self.motors = True

    def cut(self, now: int) -> None:
        """Stop the motors at `now`: in the air it falls."""
        self._commit(now)
        self.motors = False
        self._coming.clear()
        self._input = (ZERO, 0.0)

    def advance(self, now: int) -> None:
        """Advance to the last step that ends at `now` or before."""
        if not self.motors and self.standing:
            self._commit(now)
        while (end := self._step_end()) <= now:
            self._motion, self._moment = self._flown(end), end
            while self._coming and self._coming[0][0] <= end:
                _, velocity, yaw_rate = self._coming.popleft()
                self._input = (velocity, yaw_rate)

    def motion(self, now: int) -> AirframeMotion:
        """Return the motion at `now`; call `advance` first."""
        return self._flown(now) if now > self._moment else self._motion

    def attitude(self, now: int) -> Attitude:
        """Return tilt and accelerometer at `now`: its axis is along the thrust for acceleration, drag and gravity."""
        motion, drag = self.motion(now), self._parameters.drag if self.motors else 0.0
        forward, left, up = to_body(motion.acceleration, motion.yaw)
        force_forward, force_left, force_up = forward, left, up + GRAVITY
        if not self.motors:
            free_fall = not (self.standing or self._held)
            return Attitude(0.0, 0.0, ZERO if free_fall else (0.0, 0.0, -GRAVITY))
        drift_forward, drift_left, _ = scale(to_body(motion.velocity, motion.yaw), drag)
        pitch = -atan2(force_forward + drift_forward, force_up)
        roll = -atan2((force_left + drift_left) * cos(pitch), force_up)
        return Attitude(pitch, roll, _in_airframe((force_forward, -force_left, -force_up), pitch, roll))

    def _step_end(self) -> int:
        end = self._moment - self._moment % STEP + STEP
        return min(end, max(self._coming[0][0], self._moment)) if self._coming else end

    def _commit(self, now: int) -> None:
        if now > self._moment:
            self._motion, self._moment = self._flown(now), now

    def _flown(self, end: int) -> AirframeMotion:
        """Return the motion at `end` (ns), with the present input."""
        p, m, dt = self._parameters, self._motion, (end - self._moment) / SECOND
        (velocity, yaw_rate), standing = self._input, self.standing
        if not self.motors:
            return self._fallen(dt)
        if standing and velocity[2] <= 0.0:
            return AirframeMotion(m.position, ZERO, m.yaw, 0.0, ZERO)
        yaw, omega = lagged(m.yaw, m.yaw_rate, yaw_rate, p.yaw_lag, dt)
        target = to_world(velocity, (m.yaw + yaw) / 2.0)
        if self._wind is not None:
            target = add(target, self._wind.at(self._moment))
        (x, y, z), speed = lagged_motion(m.position, m.velocity, target, p.lag, dt)
        acceleration = tuple((u - v) / p.lag if p.lag else 0.0 for u, v in zip(target, speed, strict=True))
        if z < self._ground:
            return AirframeMotion((x, y, self._ground), ZERO, yaw, 0.0, ZERO)
        return AirframeMotion((x, y, z), speed, yaw, omega, acceleration)  # type: ignore[arg-type]

    def _fallen(self, dt: float) -> AirframeMotion:
        """Return the motion after `dt` s without motors."""
        m = self._motion
        if self.standing or self._held:
            return AirframeMotion(m.position, ZERO, m.yaw, 0.0, ZERO)
        vx, vy, vz = m.velocity
        x, y, z = add(m.position, (vx * dt, vy * dt, vz * dt - GRAVITY * dt * dt / 2.0))
        if z <= self._ground:
            return AirframeMotion((x, y, self._ground), ZERO, m.yaw, 0.0, ZERO)
        return AirframeMotion((x, y, z), (vx, vy, vz - GRAVITY * dt), m.yaw, 0.0, (0.0, 0.0, -GRAVITY))


def clockwise_degrees(yaw: float) -> int:
    """Return a counter-clockwise angle (rad) as the drone counts it: whole degrees clockwise, −180 to 179."""
    return (round(-yaw * 180.0 / pi) + 180) % 360 - 180


def _in_airframe(force: Vector, pitch: float, roll: float) -> Vector:
    """Return a vector (forward, right, down, level) in the frame of a body that is pitched, then rolled."""
    x, y, z = force
    x, z = cos(pitch) * x - sin(pitch) * z, sin(pitch) * x + cos(pitch) * z
    return (x, cos(roll) * y + sin(roll) * z, cos(roll) * z - sin(roll) * y)
