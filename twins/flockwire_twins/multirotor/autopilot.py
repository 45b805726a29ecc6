"""The autopilot of a multirotor: velocity to thrust vector; with rotors also attitude, rates, and rotors.

    f = a_c + K (v_c − A a_c − v) − g − z,   z' = (v' − g − f_now − z) / T                 (velocity, vertical K_z, A_z)
    omega_c = K_a e,   J^-1 tau = K_r (omega_c − omega) − y,   y' = (omega' − J^-1 tau_now − y) / T       (rates)
    w_c = w + (w(f_k) − w) / (T_m (r1 + 2 r2 w))                                               (rotors)

f is the thrust over the mass, m/s²: its tilt and size are limited, the vertical part first. A is the time by which
attitude and thrust follow: of a velocity that changes by a_c, v can have reached v_c − A a_c. z and y are integrators:
what accelerates the vehicle beside its known thrust, as wind, drag, a wrong mass or a weak motor do. They compare with
the thrust that acts, so a limit does not wind them up; z is limited as well.
"""

from __future__ import annotations

from math import sqrt, tan

from flockwire_core.domain.quaternion import Quaternion, conjugate, rotate
from flockwire_core.domain.vector import ZERO, Vector, scale
from flockwire_core.process.driving import GRAVITY

from flockwire_twins.multirotor.parameters import Parameters
from flockwire_twins.multirotor.rotors import Four, Law, RotorModel

YAW_SHARE = 0.25  # of a rotor's thrust, for yaw


class VelocityLoop:
    """The outer loop with its integrator."""

    def __init__(self, p: Parameters) -> None:
        gains, self.delays = p.autopilot, p.delays_s  # A, A_z, s
        self.tilt_limited = self.thrust_limited = 0  # steps
        self.gain = 1.0  # share of K
        self._across, self._along = gains.velocity_gain_per_s, gains.vertical_gain_per_s
        self._share, self._most = p.step_s / gains.integrator_time_s, gains.integrator_limit_m_per_s2
        self._tangent = tan(gains.tilt_limit_rad)
        self._disturbance = ZERO

    def reset(self) -> None:
        """Forget the disturbance: it stands."""
        self._disturbance = ZERO

    def thrust(
        self, wanted: Vector, change: Vector, velocity: Vector, acceleration: Vector, acting: Vector,
        bounds: tuple[float, float],
    ) -> Vector:  # fmt: skip
        """Return f, m/s², world frame, of a size within `bounds`; `change` is a_c, `acting` f_now."""
        share, (x, y, z), (ax, ay, az), (least, most) = self._share, self._disturbance, acceleration, bounds
        x, y = x + share * (ax - acting[0] - x), y + share * (ay - acting[1] - y)
        z += share * (az + GRAVITY - acting[2] - z)
        size = length((x, y, z))
        less = self._most / size if size > self._most else 1.0
        self._disturbance = zx, zy, zz = scale((x, y, z), less)
        across, along = self.gain * self._across, self.gain * self._along
        level, steep = 1.0 - across * self.delays[0], 1.0 - along * self.delays[1]
        x = level * change[0] + across * (wanted[0] - velocity[0]) - zx
        y = level * change[1] + across * (wanted[1] - velocity[1]) - zy
        wished = steep * change[2] + along * (wanted[2] - velocity[2]) + GRAVITY - zz
        z = min(max(wished, least), most)
        flat, tilted, left = sqrt(x * x + y * y), self._tangent * z, sqrt(max(most * most - z * z, 0.0))
        self.thrust_limited += wished != z or flat > left
        self.tilt_limited += flat > tilted
        less = min(tilted, left) / flat if flat > min(tilted, left) else 1.0
        return (x * less, y * less, z)


class RotorLoop:
    """The inner loops: a wanted thrust and heading become speeds of the rotors."""

    def __init__(self, p: Parameters, model: RotorModel) -> None:
        gains, (self._least, self._most), self._dt = p.autopilot, p.thrust_n, p.step_s
        (jx, jy, jz), self._lift = model.inertia, model.thrust
        lever, yaw_lever = 4.0 * model.arm, 4.0 * model.torque[1] / model.thrust[1]
        self._each: Vector = (jx / lever, jy / lever, jz / yaw_lever)  # N of a rotor for 1 rad/s²
        self._faster: Law = model.faster
        self._slower: Law = model.slower
        self._attitude, self._rate = gains.attitude_gain_per_s, gains.rate_gain_per_s
        self._yaw, self._yaw_rate = gains.yaw_gain_per_s, gains.yaw_rate_gain_per_s
        self._rotor_time, self._share = gains.rotor_time_s, p.step_s / gains.integrator_time_s
        self.reset()

    def reset(self) -> None:
        """Forget the disturbance: it stands."""
        self._disturbance, self._rates = ZERO, ZERO

    def speeds(
        self, up: Vector, total: float, turn: float, q: Quaternion, omega: Vector, acting: Vector, now: Four,
        voltage: float,
    ) -> Four:  # fmt: skip
        """Return w_c, 1/min.

        `up` is where its axis is to point (world), `total` the thrust (N), `turn` what its heading lacks (rad),
        `omega` its rates (rad/s, body), `acting` J^-1 tau_now, `now` w, `voltage` the share of full.
        """
        bx, by, _ = rotate(conjugate(q), up)
        share, dt, (px, py, pz), (x, y, z), (dx, dy, dz) = self._share, self._dt, self._rates, omega, self._disturbance
        dx += share * ((x - px) / dt - acting[0] - dx)
        dy += share * ((y - py) / dt - acting[1] - dy)
        dz += share * ((z - pz) / dt - acting[2] - dz)
        self._disturbance, self._rates = (dx, dy, dz), omega
        roll = self._each[0] * (self._rate * (-self._attitude * by - x) - dx)
        pitch = self._each[1] * (self._rate * (self._attitude * bx - y) - dy)
        yaw = self._each[2] * (self._yaw_rate * (self._yaw * turn - z) - dz)
        each, most = total / 4.0, self._most * voltage * voltage
        yaw = min(max(yaw, -YAW_SHARE * each), YAW_SHARE * each)
        a, b, c, d = -roll - pitch - yaw, pitch + yaw - roll, roll + pitch - yaw, roll - pitch + yaw
        highest = max(max(a, b), max(c, d))  # noqa: PLW3301  (compiled, max of two is a comparison)
        each = min(each, most - highest)  # attitude before thrust
        return (
            self._led(now[0], each + a, most), self._led(now[1], each + b, most),
            self._led(now[2], each + c, most), self._led(now[3], each + d, most),
        )  # fmt: skip

    def _led(self, now: float, force: float, most: float) -> float:
        """Return w_c of a rotor that turns at `now` and is to give `force`, N."""
        to, top = self._speed(min(max(force, self._least), most)), self._speed(most)
        r = self._faster if to > now else self._slower
        rate = r[0] + 2.0 * r[1] * now
        return min(max(now + (to - now) / (self._rotor_time * max(rate, 1e-6)), 0.0), top)

    def _speed(self, force: float) -> float:
        """Return w of a thrust, N."""
        p, q = self._lift
        return (sqrt(p * p + 4.0 * q * force) - p) / (2.0 * q)


def length(v: Vector) -> float:
    """Return |v|, which compiled costs less than `norm`."""
    return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
