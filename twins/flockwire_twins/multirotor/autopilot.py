"""The inner loops of a multirotor with rotors: from thrust vector and heading to the speeds of rotors.

    omega_c = K_a e,   J^-1 tau = K_r (omega_c − omega) − y,   y' = (omega' − J^-1 tau_now − y) / T       (rates)
    w_c = w + (w(f_k) − w) / (T_m (r1 + 2 r2 w))                                               (rotors)

y is an integrator like z of vehicle.py: what turns the vehicle beside its known torque, as a weak motor does.
"""

from __future__ import annotations

from math import sqrt

from flockwire_core.domain.pose import Quaternion, conjugate, rotate
from flockwire_core.domain.vector import ZERO, Vector

from flockwire_twins.multirotor.parameters import Parameters, Rotors
from flockwire_twins.multirotor.vehicle import Four, Pair

YAW_SHARE = 0.25  # of a rotor's thrust, for yaw


class RotorLoop:
    """The inner loops: a wanted thrust and heading become speeds of the rotors."""

    def __init__(self, p: Parameters, r: Rotors) -> None:
        gains, (self._least, self._most), self._dt = p.autopilot, p.thrust_n, p.step_s
        self._lift: Pair = r.thrust_per_rpm
        self._faster: Pair = r.faster_per_s
        self._slower: Pair = r.slower_per_s
        jx, jy, jz = r.inertia_kg_m2
        lever, yaw_lever = 4.0 * r.arm_m, 4.0 * r.torque_per_rpm[1] / r.thrust_per_rpm[1]
        self._each: Vector = (jx / lever, jy / lever, jz / yaw_lever)  # N of a rotor for 1 rad/s²
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
        share, dt = self._share, self._dt
        px, py, pz = self._rates
        x, y, z = omega
        dx, dy, dz = self._disturbance
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
