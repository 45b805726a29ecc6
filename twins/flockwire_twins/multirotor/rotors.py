"""A multirotor from first principles: quaternion, four rotors, the momentum of their propellers; its inner loops.

    f_k = p1 w_k + p2 w_k²,   q_k = s1 w_k + s2 w_k²                       w in 1/min
    w' = r1 (w_c − w) + r2 (w_c² − w²) rising, with r3, r4 falling
    L = R (J omega + h e3),   L' = R tau,   h = −J_p sum_k mix_zk w_k 2 pi / 60,   R' = R [omega]x
    tau = (l mix_x f, l mix_y f, mix_z q) − c omega,   mix = (−1 −1 1 1), (−1 1 1 −1), (−1 1 −1 1)
    v' = (R e3 sum f + R D R^T (v − w)) / m + g

As L is the whole angular momentum, J omega' = tau − omega × J omega + (−omega_y h, +omega_x h, −h') needs no term of
its own. The midpoint rule solves all; without tau, L is conserved exactly.

The inner loops of its autopilot, from thrust vector and heading to the speeds of rotors:

    omega_c = K_a e,   J^-1 tau = K_r (omega_c − omega) − y,   y' = (omega' − J^-1 tau_now − y) / T       (rates)
    w_c = w + (w(f_k) − w) / (T_m (r1 + 2 r2 w))                                               (rotors)

y is an integrator like z of vehicle.py: what turns the vehicle beside its known torque, as a weak motor does.
"""

from __future__ import annotations

from math import pi, sqrt

from flockwire_core.domain.pose import LEVEL, Quaternion, conjugate, product, rotate, wrapped, yaw_of
from flockwire_core.domain.vector import ZERO, Vector, norm, scale

from flockwire_twins.multirotor.parameters import Parameters, Rotors
from flockwire_twins.multirotor.vehicle import STILL, UP, Four, Pair, Vehicle, accelerated, quaternion, sum_of

YAW_SHARE = 0.25  # of a rotor's thrust, for yaw
# Position, velocity, acceleration (m, s, world), orientation, angular momentum L (kg m²/s, world), w.
RotorState = tuple[Vector, Vector, Vector, Quaternion, Vector, Four]


class RotorVehicle(Vehicle):
    """One from first principles."""

    def __init__(self, p: Parameters, r: Rotors) -> None:
        super().__init__(p)
        self._arm, self._damping, self._propeller = r.arm_m, r.damping_n_m_s, r.propeller_kg_m2 * 2.0 * pi / 60.0
        self._inertia: Vector = r.inertia_kg_m2
        self._lift: Pair = r.thrust_per_rpm
        self._torque: Pair = r.torque_per_rpm
        self._faster: Pair = r.faster_per_s
        self._slower: Pair = r.slower_per_s
        self._attitude, self._forces = RotorLoop(p, r), STILL  # N
        self._state: RotorState = (ZERO, ZERO, ZERO, LEVEL, ZERO, STILL)

    @property
    def orientation(self) -> Quaternion:
        """Its orientation."""
        return self._state[3]

    def stand(self, position: Vector, yaw: float, spins: bool) -> None:
        """Stand level."""
        q, speeds = quaternion(0.0, 0.0, yaw), self._state[5] if spins else STILL
        self._show((position, ZERO, ZERO, q, (0.0, 0.0, -self._propeller * turning(speeds)), speeds))
        self._disturbance = ZERO
        self._attitude.reset()

    def fly(
        self, wanted: Vector, change: Vector, yaw: float, wind: Vector, lift: float, voltage: float, motors: bool
    ) -> None:
        """Fly a step."""
        s, command = self._state, STILL
        _, _, acceleration, q, momentum, speeds = s
        if motors:
            acting = scale(self.up, sum_of(self._forces) / self._mass)
            f = self._thrust(wanted, change, acceleration, acting, voltage)
            tx, ty, tz = self._torques(self._forces, quadratic(self._torque, speeds), ZERO)
            jx, jy, jz = self._inertia
            size, turn = norm(f), wrapped(yaw - yaw_of(q))
            known = (tx / jx, ty / jy, tz / jz)  # as it believes: of undamaged rotors, without damping
            rates, up = self.rates(q, momentum, speeds), scale(f, 1.0 / size)
            command = self._attitude.speeds(up, self._mass * size, turn, q, rates, known, speeds, voltage)
        shares = times(self._shares, (lift, lift, lift, lift))
        self._show(self.flown(s, command, wind, self._masses, shares))

    def _show(self, state: RotorState) -> None:
        self._state, self.position, self.velocity = state, state[0], state[1]
        self.up, self._forces = rotate(state[3], UP), quadratic(self._lift, state[5])
        self.thrust = sum_of(self._forces) / self._most

    def flown(self, s: RotorState, command: Four, wind: Vector, mass: float, shares: Four) -> RotorState:
        """Return the state a step later; `command` is w_c, `shares` are of each rotor's thrust and torque, and of m."""
        (x, y, z), (vx, vy, vz), (ax, ay, az), q, (lx, ly, lz), w = s
        dt, h, per_mass = self._dt, self._dt / 2.0, 1.0 / (mass * self._mass)
        before = self.rates(q, s[4], w)
        middle = self._sped(w, w, command, h)
        speeds = self._sped(w, middle, command, dt)
        force, half = times(quadratic(self._lift, middle), shares), spun(q, before, h)
        tx, ty, tz = rotate(half, self._torques(force, times(quadratic(self._torque, middle), shares), before))
        omega = self.rates(half, (lx + h * tx, ly + h * ty, lz + h * tz), middle)
        later = (vx + h * ax, vy + h * ay, vz + h * az)
        ax, ay, az = accelerated(per_mass * sum_of(force), rotate(half, UP), later, wind, self._drag, per_mass)
        ux, uy, uz = vx + dt * ax, vy + dt * ay, vz + dt * az
        position = (x + h * (vx + ux), y + h * (vy + uy), z + h * (vz + uz))
        momentum = (lx + dt * tx, ly + dt * ty, lz + dt * tz)
        return (position, (ux, uy, uz), (ax, ay, az), spun(q, omega, dt), momentum, speeds)

    def rates(self, q: Quaternion, momentum: Vector, speeds: Four) -> Vector:
        """Return omega, rad/s, body frame: J^-1 (R^T L − h e3)."""
        jx, jy, jz = self._inertia
        x, y, z = rotate(conjugate(q), momentum)
        return (x / jx, y / jy, (z + self._propeller * turning(speeds)) / jz)

    def _torques(self, force: Four, drag: Four, omega: Vector) -> Vector:
        """Return tau, N m, body frame, of thrusts (N) and rotors' torques (N m)."""
        a, b, c, d = force
        lever, damping = self._arm, self._damping
        roll, pitch = lever * (c + d - a - b), lever * (b + c - a - d)
        return (roll - damping * omega[0], pitch - damping * omega[1], turning(drag) - damping * omega[2])

    def _sped(self, start: Four, now: Four, command: Four, dt: float) -> Four:
        a, b, c, d = now
        return (
            start[0] + dt * self._spin_up(a, command[0]), start[1] + dt * self._spin_up(b, command[1]),
            start[2] + dt * self._spin_up(c, command[2]), start[3] + dt * self._spin_up(d, command[3]),
        )  # fmt: skip

    def _spin_up(self, speed: float, command: float) -> float:
        """Return w'."""
        r = self._faster if command > speed else self._slower
        return r[0] * (command - speed) + r[1] * (command * command - speed * speed)


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


def quadratic(law: Pair, speeds: Four) -> Four:
    """Return law_1 w + law_2 w² of each rotor."""
    p, q = law
    a, b, c, d = speeds
    return (a * (p + q * a), b * (p + q * b), c * (p + q * c), d * (p + q * d))


def times(a: Four, b: Four) -> Four:
    """Return the products, rotor by rotor."""
    return (a[0] * b[0], a[1] * b[1], a[2] * b[2], a[3] * b[3])


def turning(a: Four) -> float:
    """Return mix_z a."""
    return a[1] + a[3] - a[0] - a[2]


def spun(q: Quaternion, omega: Vector, dt: float) -> Quaternion:
    """Return q after `dt` s at `omega`, rad/s, body frame (Cayley's map)."""
    h = dt / 2.0
    x, y, z, w = product(q, (h * omega[0], h * omega[1], h * omega[2], 1.0))
    n = 1.0 / sqrt(x * x + y * y + z * z + w * w)
    return (x * n, y * n, z * n, w * n)
