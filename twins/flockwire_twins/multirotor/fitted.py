"""The fitted model of a multirotor: attitude of second order, thrust with a lag, linear drag.

    roll'' = a roll + b roll' + c roll_cmd     (pitch the same; yaw with a_y, b_y, c_y)
    F' = (F_cmd − F) / T_F
    v' = (k_F F R e3 + R D R^T (v − w)) / m + g,   R = R_z R_y R_x, D = −diag(d_xy, d_xy, d_z), w the wind

The equations are those of learnsyslab/drone-models. Attitude and thrust are solved exactly over a step, velocity and
position by Heun's rule.
"""

from __future__ import annotations

from math import cos, exp, sin

from flockwire_core.domain.quaternion import Quaternion, product
from flockwire_core.domain.vector import ZERO, Vector
from flockwire_core.process.driving import GRAVITY

from flockwire_twins.multirotor.parameters import Fitted, Parameters

UP: Vector = (0.0, 0.0, 1.0)
Turn = tuple[float, float]  # an angle, rad, and its rate, rad/s
# Position (m), velocity (m/s), acceleration (m/s²), world frame; roll, pitch, yaw; R e3; F, N.
FittedState = tuple[Vector, Vector, Vector, Turn, Turn, Turn, Vector, float]
Transition = tuple[float, float, float, float]


class FittedModel:
    """The equations with the figures of `p`."""

    def __init__(self, p: Parameters, f: Fitted) -> None:
        (a, c), (ay, cy), self._dt = f.tilt_per_s2, f.yaw_per_s2, p.step_s
        self._mass, self._drag, self._gain = p.mass_kg, p.drag_kg_per_s, f.thrust_gain
        self.tilt_gain, self.yaw_gain = -c / a, -cy / ay  # of a steady command
        self._tilt, self._yaw = (
            transition(a, f.tilt_damping_per_s, p.step_s),
            transition(ay, f.yaw_damping_per_s, p.step_s),
        )
        self._decay = exp(-p.step_s / f.thrust_lag_s)

    def flown(self, s: FittedState, command: Quaternion, wind: Vector, mass: float, lift: float) -> FittedState:
        """Return the state a step later.

        `command` is roll_cmd, pitch_cmd, yaw_cmd (rad), F_cmd (N); `mass` and `lift` are shares of m and k_F.
        """
        (x, y, z), (vx, vy, vz), _, roll, pitch, yaw, up, thrust = s
        dt, per_mass = self._dt, 1.0 / (mass * self._mass)
        roll = turned(roll, self.tilt_gain * command[0], self._tilt)
        pitch = turned(pitch, self.tilt_gain * command[1], self._tilt)
        yaw = turned(yaw, self.yaw_gain * command[2], self._yaw)
        lifted = self._gain * lift * per_mass
        ax, ay, az = accelerated(lifted * thrust, up, (vx, vy, vz), wind, self._drag, per_mass)
        up, thrust = axis(roll[0], pitch[0], yaw[0]), command[3] + self._decay * (thrust - command[3])
        later = (vx + ax * dt, vy + ay * dt, vz + az * dt)
        bx, by, bz = accelerated(lifted * thrust, up, later, wind, self._drag, per_mass)
        h = dt / 2.0
        ux, uy, uz = vx + h * (ax + bx), vy + h * (ay + by), vz + h * (az + bz)
        position = (x + h * (vx + ux), y + h * (vy + uy), z + h * (vz + uz))
        return (position, (ux, uy, uz), (bx, by, bz), roll, pitch, yaw, up, thrust)


def standing(position: Vector, yaw: float, thrust: float = 0.0) -> FittedState:
    """Return the state of a vehicle at rest."""
    return (position, ZERO, ZERO, (0.0, 0.0), (0.0, 0.0), (yaw, 0.0), UP, thrust)


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
    level, left, c, s = cos(roll), -sin(roll), cos(yaw), sin(yaw)
    forward = level * sin(pitch)
    return (c * forward - s * left, s * forward + c * left, level * cos(pitch))


def quaternion(roll: float, pitch: float, yaw: float) -> Quaternion:
    """Return R as a quaternion (x, y, z, w)."""
    about_x: Quaternion = (sin(roll / 2.0), 0.0, 0.0, cos(roll / 2.0))
    about_y: Quaternion = (0.0, sin(pitch / 2.0), 0.0, cos(pitch / 2.0))
    about_z: Quaternion = (0.0, 0.0, sin(yaw / 2.0), cos(yaw / 2.0))
    return product(about_z, product(about_y, about_x))
