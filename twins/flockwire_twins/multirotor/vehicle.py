"""A multirotor with its autopilot, velocity and heading in, motion out: its outer loop, from velocity to thrust vector.

    f = a_c + K (v_c − A a_c − v) − g − z,   z' = (v' − g − f_now − z) / T                 (velocity, vertical K_z, A_z)

f is the thrust over the mass, m/s²: its tilt and size are limited, the vertical part first, but for a share. A is the
time by which attitude and thrust follow: of a velocity that changes by a_c, v can have reached v_c − A a_c. z is an
integrator: what accelerates the vehicle beside its known thrust, as wind, drag or a wrong mass do. It compares with the
thrust that acts, so a limit does not wind it up; it is limited as well.
"""

from __future__ import annotations

from math import cos, sin, sqrt, tan
from typing import Final

from flockwire_core.domain.pose import Quaternion, product
from flockwire_core.domain.vector import ZERO, Vector, norm, scale
from flockwire_core.process.driving import GRAVITY

from flockwire_twins.multirotor.parameters import Parameters
from flockwire_twins.simulated_airframe import Wear

UP: Vector = (0.0, 0.0, 1.0)
Four = tuple[float, float, float, float]  # of each rotor, or of a command
Pair = tuple[float, float]
LEVEL_SHARE: Final = 0.3  # of the most thrust, for the horizontal part while the vertical one asks for all, as PX4's
STILL: Four = (0.0, 0.0, 0.0, 0.0)


class Vehicle:
    """The common part; `thrust` is a share of the most, `up` its axis."""

    def __init__(self, p: Parameters) -> None:
        gains, self.delays = p.autopilot, p.delays_s  # A, A_z, s
        self.tilt_limited = self.thrust_limited = 0  # steps
        self.suffer(Wear())
        self.position, self.velocity, self.up, self.thrust = ZERO, ZERO, UP, 0.0
        self._mass, self._most, self._drag, self._dt = p.mass_kg, 4.0 * p.thrust_n[1], p.drag_kg_per_s, p.step_s
        gain = p.thrust_gain
        self._bounds = (4.0 * p.thrust_n[0] * gain / p.mass_kg, self._most * gain / p.mass_kg)
        self._across, self._along = gains.velocity_gain_per_s, gains.vertical_gain_per_s
        self._share, self._limit = p.step_s / gains.integrator_time_s, gains.integrator_limit_m_per_s2
        self._tangent = tan(gains.tilt_limit_rad)
        self._disturbance = ZERO

    def suffer(self, wear: Wear) -> None:
        """Set what is wrong with it."""
        self._masses, self._gains, self._shares = wear.mass, wear.gains, wear.rotors

    @property
    def orientation(self) -> Quaternion:
        """Its orientation."""
        raise NotImplementedError

    def stand(self, position: Vector, yaw: float, spins: bool) -> None:
        """Stand level at `position` (m, world) with the heading `yaw` (rad); its rotors stop, or spin as they do."""
        raise NotImplementedError

    def fly(
        self, wanted: Vector, change: Vector, yaw: float, wind: Vector, lift: float, voltage: float, motors: bool
    ) -> None:
        """Fly a step towards `wanted` (m/s), which changes by `change` (m/s²), and `yaw` (rad).

        `lift` and `voltage` are shares of the usual ones.
        """
        raise NotImplementedError

    def _thrust(self, wanted: Vector, change: Vector, acceleration: Vector, acting: Vector, voltage: float) -> Vector:
        """Return f, m/s², world frame; `change` is a_c, `acting` f_now."""
        share = self._share
        x, y, z = self._disturbance
        vx, vy, vz = self.velocity
        least, most = self._bounds[0], self._bounds[1] * voltage * voltage
        x += share * (acceleration[0] - acting[0] - x)
        y += share * (acceleration[1] - acting[1] - y)
        z += share * (acceleration[2] + GRAVITY - acting[2] - z)
        size = norm((x, y, z))
        less = self._limit / size if size > self._limit else 1.0
        zx, zy, zz = self._disturbance = scale((x, y, z), less)
        across, along = self._gains * self._across, self._gains * self._along
        level, steep = 1.0 - across * self.delays[0], 1.0 - along * self.delays[1]
        x = level * change[0] + across * (wanted[0] - vx) - zx
        y = level * change[1] + across * (wanted[1] - vy) - zy
        wished = steep * change[2] + along * (wanted[2] - vz) + GRAVITY - zz
        flat = sqrt(x * x + y * y)
        z = min(max(wished, least), sqrt(most * most - min(flat, LEVEL_SHARE * most) ** 2))
        tilted, left = self._tangent * z, sqrt(max(most * most - z * z, 0.0))
        self.thrust_limited += wished != z or flat > left
        self.tilt_limited += flat > tilted
        less = min(tilted, left) / flat if flat > min(tilted, left) else 1.0
        return (x * less, y * less, z)


def accelerated(
    lifted: float, up: Vector, velocity: Vector, wind: Vector, drag: tuple[float, float], per_mass: float
) -> Vector:
    """Return v', m/s²: of a thrust of `lifted` m/s² along `up`, drag of (d_xy, d_z) kg/s, and gravity."""
    ux, uy, uz = up
    across, along = drag
    x, y, z = velocity[0] - wind[0], velocity[1] - wind[1], velocity[2] - wind[2]
    flat = -across * per_mass
    rise = lifted + (across - along) * per_mass * (x * ux + y * uy + z * uz)
    return (rise * ux + flat * x, rise * uy + flat * y, rise * uz + flat * z - GRAVITY)


def quaternion(roll: float, pitch: float, yaw: float) -> Quaternion:
    """Return R as a quaternion (x, y, z, w)."""
    about_x: Quaternion = (sin(roll / 2.0), 0.0, 0.0, cos(roll / 2.0))
    about_y: Quaternion = (0.0, sin(pitch / 2.0), 0.0, cos(pitch / 2.0))
    about_z: Quaternion = (0.0, 0.0, sin(yaw / 2.0), cos(yaw / 2.0))
    return product(about_z, product(about_y, about_x))


def sum_of(a: Four) -> float:
    """Return the sum over the rotors."""
    return a[0] + a[1] + a[2] + a[3]
