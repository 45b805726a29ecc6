"""A multirotor from first principles: quaternion, four rotors, the momentum of their propellers.

    f_k = p1 w_k + p2 w_k²,   q_k = s1 w_k + s2 w_k²                       w in 1/min
    w' = r1 (w_c − w) + r2 (w_c² − w²) rising, with r3, r4 falling
    L = R (J omega + h e3),   L' = R tau,   h = −J_p sum_k mix_zk w_k 2 pi / 60,   R' = R [omega]x
    tau = (l mix_x f, l mix_y f, mix_z q) − c omega
    v' = (R e3 sum f + R D R^T (v − w)) / m + g

As L is the whole angular momentum, J omega' = tau − omega × J omega + (−omega_y h, +omega_x h, −h') needs no term of
its own. The midpoint rule solves all; without tau, L is conserved exactly.
"""

from __future__ import annotations

from math import pi, sqrt
from typing import Final

from flockwire_core.compiling import mypyc_attr
from flockwire_core.domain.quaternion import Quaternion, conjugate, product, rotate
from flockwire_core.domain.record import Record
from flockwire_core.domain.vector import Vector

from flockwire_twins.multirotor.fitted import UP, accelerated

Four = tuple[float, float, float, float]  # of each rotor
MIX_X: Four = (-1.0, -1.0, 1.0, 1.0)
MIX_Y: Four = (-1.0, 1.0, 1.0, -1.0)
MIX_Z: Four = (-1.0, 1.0, -1.0, 1.0)
EVERY: Four = (1.0, 1.0, 1.0, 1.0)
Law = tuple[float, float]  # coefficients of w and w²


@mypyc_attr(acyclic=True)
class RotorState(Record):
    """Position, velocity, acceleration (m, s, world), orientation, angular momentum L (kg m²/s, world), w (1/min)."""

    __slots__ = ("position", "velocity", "acceleration", "orientation", "momentum", "speeds")

    def __init__(
        self, position: Vector, velocity: Vector, acceleration: Vector, orientation: Quaternion, momentum: Vector,
        speeds: Four,
    ) -> None:  # fmt: skip
        self.position: Final = position
        self.velocity: Final = velocity
        self.acceleration: Final = acceleration
        self.orientation: Final = orientation
        self.momentum: Final = momentum
        self.speeds: Final = speeds


class RotorModel:
    """The equations with their figures, SI but for w; `drag` is (d_xy, d_z), `damping` c, `propeller` J_p."""

    def __init__(
        self, mass: float, drag: tuple[float, float], arm: float, inertia: Vector, damping: float, thrust: Law,
        torque: Law, faster: Law, slower: Law, propeller: float, dt: float,
    ) -> None:  # fmt: skip
        self._mass, self._drag, self._arm, self._inertia, self._damping = mass, drag, arm, inertia, damping
        self._thrust, self._torque, self._faster, self._slower = thrust, torque, faster, slower
        self._propeller, self._dt = propeller * 2.0 * pi / 60.0, dt

    def flown(self, s: RotorState, command: Four, wind: Vector, mass: float, shares: Four) -> RotorState:
        """Return the state a step later; `command` is w_c, `shares` are of each rotor's thrust and torque, and of m."""
        dt, h, q, (vx, vy, vz) = self._dt, self._dt / 2.0, s.orientation, s.velocity
        before = self.rates(q, s.momentum, s.speeds)
        middle = self._sped(s.speeds, s.speeds, command, h)
        speeds = self._sped(s.speeds, middle, command, dt)
        force = times(self.forces(middle), shares)
        half = spun(q, before, h)
        tx, ty, tz = rotate(half, self.torques(force, times(quadratic(self._torque, middle), shares), before))
        lx, ly, lz = s.momentum
        omega = self.rates(half, (lx + h * tx, ly + h * ty, lz + h * tz), middle)
        ax, ay, az = s.acceleration
        per_mass, velocity = 1.0 / (mass * self._mass), (vx + h * ax, vy + h * ay, vz + h * az)
        acceleration = accelerated(per_mass * whole(force), rotate(half, UP), velocity, wind, self._drag, per_mass)
        ax, ay, az = acceleration
        ux, uy, uz = vx + dt * ax, vy + dt * ay, vz + dt * az
        x, y, z = s.position
        position = (x + h * (vx + ux), y + h * (vy + uy), z + h * (vz + uz))
        momentum = (lx + dt * tx, ly + dt * ty, lz + dt * tz)
        return RotorState(position, (ux, uy, uz), acceleration, spun(q, omega, dt), momentum, speeds)

    def rates(self, q: Quaternion, momentum: Vector, speeds: Four) -> Vector:
        """Return omega, rad/s, body frame: J^-1 (R^T L − h e3)."""
        (jx, jy, jz), (x, y, z) = self._inertia, rotate(conjugate(q), momentum)
        return (x / jx, y / jy, (z + self._propeller * whole(times(MIX_Z, speeds))) / jz)

    def momentum(self, q: Quaternion, omega: Vector, speeds: Four) -> Vector:
        """Return L of the angular velocity `omega`, rad/s, body frame."""
        (jx, jy, jz), (x, y, z) = self._inertia, omega
        return rotate(q, (jx * x, jy * y, jz * z - self._propeller * whole(times(MIX_Z, speeds))))

    def forces(self, speeds: Four) -> Four:
        """Return the thrust of each rotor, N."""
        return quadratic(self._thrust, speeds)

    def torques(self, force: Four, drag: Four, omega: Vector) -> Vector:
        """Return tau, N m, body frame, of thrusts (N) and rotors' torques (N m)."""
        l, c, (x, y, z) = self._arm, self._damping, omega  # noqa: E741  (the lever)
        roll, pitch = l * whole(times(MIX_X, force)), l * whole(times(MIX_Y, force))
        return (roll - c * x, pitch - c * y, whole(times(MIX_Z, drag)) - c * z)

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


def quadratic(law: Law, speeds: Four) -> Four:
    """Return law_1 w + law_2 w² of each rotor."""
    p, q, (a, b, c, d) = law[0], law[1], speeds
    return (a * (p + q * a), b * (p + q * b), c * (p + q * c), d * (p + q * d))


def times(a: Four, b: Four) -> Four:
    """Return the products, rotor by rotor."""
    return (a[0] * b[0], a[1] * b[1], a[2] * b[2], a[3] * b[3])


def whole(a: Four) -> float:
    """Return the sum over the rotors."""
    return a[0] + a[1] + a[2] + a[3]


def spun(q: Quaternion, omega: Vector, dt: float) -> Quaternion:
    """Return q after `dt` s at `omega`, rad/s, body frame (Cayley's map)."""
    h = dt / 2.0
    x, y, z, w = product(q, (h * omega[0], h * omega[1], h * omega[2], 1.0))
    n = 1.0 / sqrt(x * x + y * y + z * z + w * w)
    return (x * n, y * n, z * n, w * n)
