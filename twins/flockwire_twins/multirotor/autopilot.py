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

from math import hypot, sqrt, tan

from flockwire_core.domain.quaternion import Quaternion, conjugate, rotate
from flockwire_core.domain.vector import ZERO, Vector, limit
from flockwire_core.process.driving import GRAVITY

from flockwire_twins.multirotor.parameters import Autopilot, Parameters, Rotors
from flockwire_twins.multirotor.rotors import MIX_X, MIX_Y, MIX_Z, Four, Law

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
        share, (zx, zy, zz), (ax, ay, az) = self._share, self._disturbance, acceleration
        zx, zy = zx + share * (ax - acting[0] - zx), zy + share * (ay - acting[1] - zy)
        zz += share * (az + GRAVITY - acting[2] - zz)
        self._disturbance = zx, zy, zz = limit((zx, zy, zz), self._most)
        across, along, (least, most) = self.gain * self._across, self.gain * self._along, bounds
        level, steep = 1.0 - across * self.delays[0], 1.0 - along * self.delays[1]
        x = level * change[0] + across * (wanted[0] - velocity[0]) - zx
        y = level * change[1] + across * (wanted[1] - velocity[1]) - zy
        wished = steep * change[2] + along * (wanted[2] - velocity[2]) + GRAVITY - zz
        z = min(max(wished, least), most)
        flat, tilted, left = hypot(x, y), self._tangent * z, sqrt(max(most * most - z * z, 0.0))
        room = min(tilted, left)
        self.thrust_limited += wished != z or flat > left
        self.tilt_limited += flat > tilted
        if flat > room:
            x, y = x * room / flat, y * room / flat
        return (x, y, z)


class RotorLoop:
    """The inner loops: a wanted thrust and heading become speeds of the rotors."""

    def __init__(self, gains: Autopilot, rotors: Rotors, thrust: tuple[float, float], dt: float) -> None:
        jx, jy, jz = rotors.inertia_kg_m2
        self._inertia: Vector = (jx, jy, jz)
        self._arm, self._least, self._most = rotors.arm_m, thrust[0], thrust[1]
        self._lift: Law = rotors.thrust_per_rpm
        self._faster: Law = rotors.faster_per_s
        self._slower: Law = rotors.slower_per_s
        self._yaw_lever = rotors.torque_per_rpm[1] / rotors.thrust_per_rpm[1]
        self._attitude, self._rate = gains.attitude_gain_per_s, gains.rate_gain_per_s
        self._yaw, self._yaw_rate = gains.yaw_gain_per_s, gains.yaw_rate_gain_per_s
        self._rotor_time, self._share, self._dt = gains.rotor_time_s, dt / gains.integrator_time_s, dt
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
        share, dt, (px, py, pz), (x, y, z) = self._share, self._dt, self._rates, omega
        dx, dy, dz = self._disturbance
        self._disturbance = dx, dy, dz = (
            dx + share * ((x - px) / dt - acting[0] - dx), dy + share * ((y - py) / dt - acting[1] - dy),
            dz + share * ((z - pz) / dt - acting[2] - dz),
        )  # fmt: skip
        self._rates, (jx, jy, jz) = omega, self._inertia
        roll = jx * (self._rate * (-self._attitude * by - x) - dx) / (4.0 * self._arm)
        pitch = jy * (self._rate * (self._attitude * bx - y) - dy) / (4.0 * self._arm)
        yaw = jz * (self._yaw_rate * (self._yaw * turn - z) - dz) / (4.0 * self._yaw_lever)
        each, least, most = total / 4.0, self._least, self._most * voltage * voltage
        yaw = min(max(yaw, -YAW_SHARE * each), YAW_SHARE * each)
        a, b, c, d = [x * roll + y * pitch + z * yaw for x, y, z in zip(MIX_X, MIX_Y, MIX_Z, strict=True)]
        each = min(each, most - max(a, b, c, d))  # attitude before thrust
        a, b, c, d = [self._speed(min(max(each + part, least), most)) for part in (a, b, c, d)]
        top = self._speed(most)
        a, b, c, d = [self._led(w, to, top) for w, to in zip(now, (a, b, c, d), strict=True)]
        return (a, b, c, d)

    def _speed(self, force: float) -> float:
        """Return w of a thrust, N."""
        p, q = self._lift
        return (sqrt(p * p + 4.0 * q * force) - p) / (2.0 * q)

    def _led(self, now: float, to: float, top: float) -> float:
        r = self._faster if to > now else self._slower
        rate = r[0] + 2.0 * r[1] * now
        return min(max(now + (to - now) / (self._rotor_time * max(rate, 1e-6)), 0.0), top)
