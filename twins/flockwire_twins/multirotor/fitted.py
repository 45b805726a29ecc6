"""The fitted model of a multirotor: attitude of second order, thrust with a lag, linear drag.

    roll'' = a roll + b roll' + c roll_cmd     (pitch the same; yaw with a_y, b_y, c_y)
    F' = (F_cmd − F) / T_F
    v' = (k_F F R e3 + R D R^T (v − w)) / m + g,   R = R_z R_y R_x, D = −diag(d_xy, d_xy, d_z), w the wind

The equations are those of learnsyslab/drone-models. Attitude and thrust are solved exactly over a step, velocity and
position by Heun's rule.
"""

from __future__ import annotations

from math import asin, atan2, cos, exp, sin

from flockwire_core.domain.pose import Quaternion
from flockwire_core.domain.vector import ZERO, Vector, norm, scale

from flockwire_twins.multirotor.parameters import Fitted, Parameters
from flockwire_twins.multirotor.vehicle import STILL, UP, Four, Pair, Vehicle, accelerated, quaternion, sum_of

Turn = Pair  # an angle, rad, and its rate, rad/s
# Position (m), velocity (m/s), acceleration (m/s²), world frame; roll, pitch, yaw; R e3; F, N.
FittedState = tuple[Vector, Vector, Vector, Turn, Turn, Turn, Vector, float]


class FittedVehicle(Vehicle):
    """One by the fitted model."""

    def __init__(self, p: Parameters, f: Fitted) -> None:
        super().__init__(p)
        (a, c), (ay, cy) = f.tilt_per_s2, f.yaw_per_s2
        self._gain, self._tilt_gain, self._yaw_gain = f.thrust_gain, -c / a, -cy / ay  # of steady commands
        self._tilt = transition(a, f.tilt_damping_per_s, p.step_s)
        self._yaw = transition(ay, f.yaw_damping_per_s, p.step_s)
        self._decay = exp(-p.step_s / f.thrust_lag_s)
        self._state = standing(ZERO, 0.0)

    @property
    def orientation(self) -> Quaternion:
        """Its orientation."""
        return quaternion(self._state[3][0], self._state[4][0], self._state[5][0])

    def stand(self, position: Vector, yaw: float, spins: bool) -> None:
        """Stand level."""
        self._show(standing(position, yaw, self._state[7] if spins else 0.0))
        self._disturbance = ZERO

    def fly(
        self, wanted: Vector, change: Vector, yaw: float, wind: Vector, lift: float, voltage: float, motors: bool
    ) -> None:
        """Fly a step."""
        s, command = self._state, STILL
        if motors:
            acting = scale(self.up, self._gain * s[7] / self._mass)
            x, y, z = f = self._thrust(wanted, change, s[2], acting, voltage)
            size, c, n = norm(f), cos(s[5][0]), sin(s[5][0])
            roll, pitch = asin((n * x - c * y) / size), atan2(c * x + n * y, z)
            tilt, force = self._tilt_gain, self._mass * size / self._gain
            command = (roll / tilt, pitch / tilt, yaw / self._yaw_gain, force)
        self._show(self.flown(s, command, wind, self._masses, lift * sum_of(self._shares) / 4.0))

    def _show(self, state: FittedState) -> None:
        self._state, self.position, self.velocity = state, state[0], state[1]
        self.up, self.thrust = state[6], state[7] / self._most

    def flown(self, s: FittedState, command: Four, wind: Vector, mass: float, lift: float) -> FittedState:
        """Return the state a step later.

        `command` is roll_cmd, pitch_cmd, yaw_cmd (rad), F_cmd (N); `mass` and `lift` are shares of m and k_F.
        """
        (x, y, z), (vx, vy, vz), _, roll, pitch, yaw, up, thrust = s
        dt, per_mass = self._dt, 1.0 / (mass * self._mass)
        roll = turned(roll, self._tilt_gain * command[0], self._tilt)
        pitch = turned(pitch, self._tilt_gain * command[1], self._tilt)
        yaw = turned(yaw, self._yaw_gain * command[2], self._yaw)
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


def transition(a: float, b: float, dt: float) -> Four:
    """Return exp([[0, 1], [a, b]] dt), row by row, by its series."""
    p, q, r, s = 1.0, 0.0, 0.0, 1.0  # the term of order k
    total = (p, q, r, s)
    for k in range(1, 20):
        h = dt / k
        p, q, r, s = h * q * a, h * (p + q * b), h * s * a, h * (r + s * b)
        total = (total[0] + p, total[1] + q, total[2] + r, total[3] + s)
    return total


def turned(turn: Turn, steady: float, m: Four) -> Turn:
    """Return angle and rate a step later; `steady` is the angle at which it would stay."""
    e, rate = turn[0] - steady, turn[1]
    return (steady + m[0] * e + m[1] * rate, m[2] * e + m[3] * rate)


def axis(roll: float, pitch: float, yaw: float) -> Vector:
    """Return R e3, R = R_z(yaw) R_y(pitch) R_x(roll)."""
    level, left, c, s = cos(roll), -sin(roll), cos(yaw), sin(yaw)
    forward = level * sin(pitch)
    return (c * forward - s * left, s * forward + c * left, level * cos(pitch))
