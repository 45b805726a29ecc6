"""The fitted model of a multirotor: attitude of second order, thrust with a lag, linear drag.

    roll'' = a roll + b roll' + c roll_cmd     (pitch the same; yaw with a_y, b_y, c_y)
    F' = (F_cmd − F) / T_F
    v' = (k_F F R e3 + R D R^T (v − w)) / m + g,   R = R_z R_y R_x, D = −diag(d_xy, d_xy, d_z), w the wind

The equations are those of learnsyslab/drone-models. Attitude and thrust are solved exactly over a step, velocity and
position by Heun's rule.
"""

from __future__ import annotations

from math import cos, exp, sin
from typing import Final

from flockwire_core.compiling import mypyc_attr
from flockwire_core.domain.quaternion import Quaternion, product
from flockwire_core.domain.record import Record
from flockwire_core.domain.vector import ZERO, Vector
from flockwire_core.process.driving import GRAVITY

UP: Vector = (0.0, 0.0, 1.0)
Turn = tuple[float, float]  # an angle, rad, and its rate, rad/s
Transition = tuple[float, float, float, float]


@mypyc_attr(acyclic=True)
class FittedState(Record):
    """Position (m), velocity (m/s), acceleration (m/s²), world frame; roll, pitch, yaw; `up`: R e3; `thrust`: F, N."""

    __slots__ = ("position", "velocity", "acceleration", "roll", "pitch", "yaw", "up", "thrust")

    def __init__(
        self, position: Vector, velocity: Vector, acceleration: Vector, roll: Turn, pitch: Turn, yaw: Turn, up: Vector,
        thrust: float,
    ) -> None:  # fmt: skip
        self.position: Final = position
        self.velocity: Final = velocity
        self.acceleration: Final = acceleration
        self.roll: Final = roll
        self.pitch: Final = pitch
        self.yaw: Final = yaw
        self.up: Final = up
        self.thrust: Final = thrust


class FittedModel:
    """The equations with their figures, for steps of `dt` s: `tilt` is (a, b, c), `yaw` (a_y, b_y, c_y)."""

    def __init__(
        self, mass: float, drag: tuple[float, float], tilt: Vector, yaw: Vector, thrust_gain: float, thrust_lag: float,
        dt: float,
    ) -> None:  # fmt: skip
        self._mass, self._drag, self._gain, self._dt = mass, drag, thrust_gain, dt
        self.tilt_gain, self.yaw_gain = -tilt[2] / tilt[0], -yaw[2] / yaw[0]  # of a steady command
        self._tilt, self._yaw = transition(tilt[0], tilt[1], dt), transition(yaw[0], yaw[1], dt)
        self._decay = exp(-dt / thrust_lag)

    def flown(self, s: FittedState, command: Quaternion, wind: Vector, mass: float, lift: float) -> FittedState:
        """Return the state a step later.

        `command` is roll_cmd, pitch_cmd, yaw_cmd (rad), F_cmd (N); `mass` and `lift` are shares of m and k_F.
        """
        dt, decay, (roll, pitch, yaw, thrust) = self._dt, self._decay, command
        rolled = turned(s.roll, self.tilt_gain * roll, self._tilt)
        pitched = turned(s.pitch, self.tilt_gain * pitch, self._tilt)
        yawed = turned(s.yaw, self.yaw_gain * yaw, self._yaw)
        up, force = axis(rolled[0], pitched[0], yawed[0]), thrust + decay * (s.thrust - thrust)
        per_mass, ((x, y, z), (vx, vy, vz)) = 1.0 / (mass * self._mass), (s.position, s.velocity)
        lifted = self._gain * lift * per_mass
        ax, ay, az = accelerated(lifted * s.thrust, s.up, s.velocity, wind, self._drag, per_mass)
        later = (vx + ax * dt, vy + ay * dt, vz + az * dt)
        bx, by, bz = accelerated(lifted * force, up, later, wind, self._drag, per_mass)
        h = dt / 2.0
        ux, uy, uz = vx + h * (ax + bx), vy + h * (ay + by), vz + h * (az + bz)
        position = (x + h * (vx + ux), y + h * (vy + uy), z + h * (vz + uz))
        return FittedState(position, (ux, uy, uz), (bx, by, bz), rolled, pitched, yawed, up, force)


def standing(position: Vector, yaw: float, thrust: float = 0.0) -> FittedState:
    """Return the state of a vehicle at rest."""
    level = (0.0, 0.0)
    return FittedState(position, ZERO, ZERO, level, level, (yaw, 0.0), UP, thrust)


def accelerated(
    lifted: float, up: Vector, velocity: Vector, wind: Vector, drag: tuple[float, float], per_mass: float
) -> Vector:
    """Return v', m/s²: of a thrust of `lifted` m/s² along `up`, drag of (d_xy, d_z) kg/s, and gravity."""
    (ux, uy, uz), (across, along) = up, drag
    x, y, z = velocity[0] - wind[0], velocity[1] - wind[1], velocity[2] - wind[2]
    flat = -across * per_mass
    rise = lifted + (across - along) * per_mass * (x * ux + y * uy + z * uz)
    return (rise * ux + flat * x, rise * uy + flat * y, rise * uz + flat * z - GRAVITY)


def transition(a: float, b: float, dt: float) -> Transition:
    """Return exp([[0, 1], [a, b]] dt), row by row, by its series."""
    p, q, r, s = 1.0, 0.0, 0.0, 1.0  # the term of order k
    total = (p, q, r, s)
    for k in range(1, 20):
        h = dt / k
        p, q, r, s = h * q * a, h * (p + q * b), h * s * a, h * (r + s * b)
        total = (total[0] + p, total[1] + q, total[2] + r, total[3] + s)
    return total


def turned(turn: Turn, steady: float, m: Transition) -> Turn:
    """Return angle and rate a step later; `steady` is the angle at which it would stay."""
    e, rate = turn[0] - steady, turn[1]
    return (steady + m[0] * e + m[1] * rate, m[2] * e + m[3] * rate)


def axis(roll: float, pitch: float, yaw: float) -> Vector:
    """Return R e3, R = R_z(yaw) R_y(pitch) R_x(roll)."""
    forward, left = cos(roll) * sin(pitch), -sin(roll)
    c, s = cos(yaw), sin(yaw)
    return (c * forward - s * left, s * forward + c * left, cos(roll) * cos(pitch))


def quaternion(roll: float, pitch: float, yaw: float) -> Quaternion:
    """Return R as a quaternion (x, y, z, w)."""
    about_x: Quaternion = (sin(roll / 2.0), 0.0, 0.0, cos(roll / 2.0))
    about_y: Quaternion = (0.0, sin(pitch / 2.0), 0.0, cos(pitch / 2.0))
    about_z: Quaternion = (0.0, 0.0, sin(yaw / 2.0), cos(yaw / 2.0))
    return product(about_z, product(about_y, about_x))
