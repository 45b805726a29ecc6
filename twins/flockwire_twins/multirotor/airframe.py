"""A simulated multirotor among airframes: commands, ground, battery, wind, and what is at its limit.

    near the ground   f → f / (1 − (r / 4 z)²), z >= r / 2        (Cheeseman and Bennett 1955)
    battery           charge' = −(f / m g)^1.5 / endurance        (power of an actuator disc)
    voltage           1 − sag_empty (1 − charge) − sag_load f / f_most; the most thrust goes with its square

It flies in fixed steps, counted from its start: the flight does not depend on the rate of calls. Without motors it
falls; with rotors it also tumbles. One that is upside down, or hits the ground, stops its motors.
"""

from __future__ import annotations

from collections.abc import Callable
from math import sqrt
from typing import Final

from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.domain.vector import ZERO, Vector, add, scale
from flockwire_core.process.driving import CONTACT, GRAVITY
from flockwire_core.swarm.drones import Airframe
from flockwire_core.swarm.model import Swarm

from flockwire_twins.kinematics.airframe import GROUNDED, STOPPED, FlyingBody
from flockwire_twins.kinematics.drone import SimulatedDrone
from flockwire_twins.multirotor.fitted import FittedVehicle
from flockwire_twins.multirotor.parameters import Parameters, parameters_of
from flockwire_twins.multirotor.rotors import RotorVehicle
from flockwire_twins.multirotor.vehicle import Vehicle
from flockwire_twins.simulated_airframe import Wear

CRASH: Final = 2.0  # m/s at which it does not survive to touch the ground
STEEP: Final = 0.7  # least cosine of its tilt there
TURNED_OVER: Final = "turned over"
CRASHED: Final = "hit the ground"


class Multirotor(FlyingBody):
    """One multirotor with the figures `p`."""

    def __init__(
        self, parameters: Airframe, p: Parameters, position: Vector, yaw: float, now: int, ground: float = 0.0,
        standing: bool = False,
    ) -> None:  # fmt: skip
        super().__init__(parameters, 0.0, 0.0, position, now, ground, standing)  # lag, dead time beside its own
        self.vehicle = make_vehicle(p)
        self._dt, self._step, self._yaw = p.step_s, nanoseconds(p.step_s), yaw
        self._followed = self._changed = ZERO  # the command behind the lag, m/s, and how it changes, m/s²
        self._lifted = self.state is not GROUNDED
        self._place = position  # where it stands
        self._radius, self._empty, self._load = p.ground_effect_radius_m, p.sag_empty, p.sag_load
        self._hover = p.mass_kg * GRAVITY / (4.0 * p.thrust_n[1])  # share of the most thrust
        self.vehicle.stand(position, yaw, spins=False)
        self._show(0.0)

    def wear(self, wear: Wear) -> None:
        """Set what is wrong with it."""
        self.vehicle.suffer(wear)

    @property
    def remark(self) -> str:
        """What is at its limit."""
        limited = ((self.vehicle.tilt_limited, "tilt"), (self.vehicle.thrust_limited, "thrust"))
        return ", ".join([f"{count} steps at the limit of {what}" for count, what in limited if count])

    def _fly(self, until: int) -> None:
        while self._now + self._step <= until:
            self._now += self._step
            if self.state is not GROUNDED and (self.state is not STOPPED or self.falling):
                self._move()
        self._show((until - self._now) / SECOND)

    def _move(self) -> None:
        """Fly or fall for a step."""
        vehicle, dt, motors = self.vehicle, self._dt, self.state is not STOPPED
        wind = self._wind.at(self._now - self._step) if self._wind is not None else ZERO
        share = dt / (self._lag + dt)
        self._followed = approach(self._followed, self._input, share)
        self._changed = approach(self._changed, self._change, share)
        self._yaw += dt * self._yaw_rate
        voltage = 1.0 - self._empty * (1.0 - self.battery) - self._load * vehicle.thrust
        vehicle.fly(self._followed, self._changed, self._yaw, wind, self._lift(), voltage, motors)
        if motors:
            relative = max(0.0, vehicle.thrust / self._hover)
            self.battery = max(0.0, self.battery - dt * relative * sqrt(relative) / self._endurance)
        if not self._lifted:
            self._lifted = vehicle.velocity[2] > 0.0
            if not self._lifted:
                vehicle.stand(self._place, self._yaw, spins=True)
        if self._lifted and vehicle.up[2] < 0.0:
            self._fail(TURNED_OVER)
        x, y, z = vehicle.position
        if vehicle.velocity[2] < 0.0 and z - self._ground <= CONTACT:
            if vehicle.velocity[2] < -CRASH or vehicle.up[2] < STEEP:
                self._fail(CRASHED)
            self._stand((x, y, self._ground))

    def _fail(self, reason: str) -> None:
        if self.state is not STOPPED:
            self.failure = reason
            self.stop()

    def _lift(self) -> float:
        """Return the share by which the ground raises the thrust."""
        if not self._radius:
            return 1.0
        z = max(self.vehicle.position[2] - self._ground, self._radius / 2.0)
        return 1.0 / (1.0 - (self._radius / (4.0 * z)) ** 2)

    def _stand(self, place: Vector) -> None:
        """Stand on the ground, which it touches: level, unless its motors were off."""
        self._place, self._lifted, self._followed = place, False, ZERO
        if self.state is STOPPED:  # it lies as it fell
            self.vehicle.position, self.vehicle.velocity = place, ZERO
        else:
            self.vehicle.stand(place, self._yaw, spins=False)
            self.state = GROUNDED

    def _show(self, dt: float) -> None:
        """Show the motion, `dt` s after the last step."""
        vehicle = self.vehicle
        self.velocity, self.orientation = vehicle.velocity, vehicle.orientation
        self.position = add(vehicle.position, scale(vehicle.velocity, dt))


def make_vehicle(p: Parameters) -> Vehicle:
    """Return a vehicle: by the fitted model if it has one."""
    if p.fitted is not None:
        return FittedVehicle(p, p.fitted)
    if p.rotors is not None:
        return RotorVehicle(p, p.rotors)
    raise ValueError("neither a fitted model nor rotors")


def approach(v: Vector, to: Vector, share: float) -> Vector:
    """Return `v` nearer to `to` by `share`."""
    return (v[0] + share * (to[0] - v[0]), v[1] + share * (to[1] - v[1]), v[2] + share * (to[2] - v[2]))


def standing(swarm: Swarm, number: int, now: int, _: Callable[[], float]) -> SimulatedDrone:
    """Return drone `number` of `swarm` at its start; it has no random values."""
    drone, parameters = swarm.drone(number), swarm.airframe(number)
    figures = parameters_of(parameters)
    body = Multirotor(parameters, figures, drone.start, drone.heading, now, swarm.ground, standing=True)
    return SimulatedDrone(body, swarm.limits)
