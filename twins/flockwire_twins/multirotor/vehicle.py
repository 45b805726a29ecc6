"""A multirotor with its autopilot, by the fitted model or with rotors: velocity and heading in, motion out."""

from __future__ import annotations

from math import asin, atan2, cos, sin

from flockwire_core.domain.pose import LEVEL, wrapped, yaw_of
from flockwire_core.domain.quaternion import Quaternion, rotate
from flockwire_core.domain.vector import ZERO, Vector, scale

from flockwire_twins.multirotor import fitted
from flockwire_twins.multirotor.autopilot import RotorLoop, VelocityLoop, length
from flockwire_twins.multirotor.fitted import UP, FittedModel
from flockwire_twins.multirotor.parameters import Fitted, Parameters, Rotors
from flockwire_twins.multirotor.rotors import Four, RotorModel, RotorState, quadratic, times, whole
from flockwire_twins.simulated_airframe import Wear

STILL: Four = (0.0, 0.0, 0.0, 0.0)


class Vehicle:
    """The common part; `thrust` is a share of the most, `up` its axis."""

    def __init__(self, p: Parameters) -> None:
        self.loop = VelocityLoop(p)
        self.suffer(Wear())
        self.position, self.velocity, self.up, self.thrust = ZERO, ZERO, UP, 0.0
        self._mass, self._most = p.mass_kg, 4.0 * p.thrust_n[1]
        gain = p.fitted.thrust_gain if p.fitted is not None else 1.0
        self._bounds = (4.0 * p.thrust_n[0] * gain / p.mass_kg, self._most * gain / p.mass_kg)

    def suffer(self, wear: Wear) -> None:
        """Set what is wrong with it."""
        self._masses, self.loop.gain, self._shares = wear.mass, wear.gains, wear.rotors

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
        least, most = self._bounds
        return self.loop.thrust(wanted, change, self.velocity, acceleration, acting, (least, most * voltage * voltage))


class FittedVehicle(Vehicle):
    """One by the fitted model."""

    def __init__(self, p: Parameters, f: Fitted) -> None:
        super().__init__(p)
        self._gain, self._model, self._state = f.thrust_gain, FittedModel(p, f), fitted.standing(ZERO, 0.0)

    @property
    def orientation(self) -> Quaternion:
        """Its orientation."""
        return fitted.quaternion(self._state[3][0], self._state[4][0], self._state[5][0])

    def stand(self, position: Vector, yaw: float, spins: bool) -> None:
        """Stand level."""
        self._show(fitted.standing(position, yaw, self._state[7] if spins else 0.0))
        self.loop.reset()

    def fly(
        self, wanted: Vector, change: Vector, yaw: float, wind: Vector, lift: float, voltage: float, motors: bool
    ) -> None:
        """Fly a step."""
        s, model, command = self._state, self._model, STILL
        if motors:
            acting = scale(self.up, self._gain * s[7] / self._mass)
            x, y, z = f = self._thrust(wanted, change, s[2], acting, voltage)
            size, c, n = length(f), cos(s[5][0]), sin(s[5][0])
            roll, pitch = asin((n * x - c * y) / size), atan2(c * x + n * y, z)
            tilt, force = model.tilt_gain, self._mass * size / self._gain
            command = (roll / tilt, pitch / tilt, yaw / model.yaw_gain, force)
        self._show(model.flown(s, command, wind, self._masses, lift * whole(self._shares) / 4.0))

    def _show(self, state: fitted.FittedState) -> None:
        self._state, self.position, self.velocity = state, state[0], state[1]
        self.up, self.thrust = state[6], state[7] / self._most


class RotorVehicle(Vehicle):
    """One from first principles."""

    def __init__(self, p: Parameters, r: Rotors) -> None:
        super().__init__(p)
        self._model = model = RotorModel(p, r)
        self._attitude, self._forces = RotorLoop(p, model), STILL  # N
        self._state: RotorState = (ZERO, ZERO, ZERO, LEVEL, ZERO, STILL)

    @property
    def orientation(self) -> Quaternion:
        """Its orientation."""
        return self._state[3]

    def stand(self, position: Vector, yaw: float, spins: bool) -> None:
        """Stand level."""
        q, speeds = fitted.quaternion(0.0, 0.0, yaw), self._state[5] if spins else STILL
        self._show((position, ZERO, ZERO, q, self._model.momentum(q, ZERO, speeds), speeds))
        self.loop.reset()
        self._attitude.reset()

    def fly(
        self, wanted: Vector, change: Vector, yaw: float, wind: Vector, lift: float, voltage: float, motors: bool
    ) -> None:
        """Fly a step."""
        s, model, command = self._state, self._model, STILL
        _, _, acceleration, q, momentum, speeds = s
        if motors:
            acting = scale(self.up, whole(self._forces) / self._mass)
            f = self._thrust(wanted, change, acceleration, acting, voltage)
            tx, ty, tz = model.torques(self._forces, quadratic(model.torque, speeds), ZERO)
            (jx, jy, jz), size, turn = model.inertia, length(f), wrapped(yaw - yaw_of(q))
            known = (tx / jx, ty / jy, tz / jz)  # as it believes: of undamaged rotors, without damping
            rates, up = model.rates(q, momentum, speeds), scale(f, 1.0 / size)
            command = self._attitude.speeds(up, self._mass * size, turn, q, rates, known, speeds, voltage)
        shares = times(self._shares, (lift, lift, lift, lift))
        self._show(model.flown(s, command, wind, self._masses, shares))

    def _show(self, state: RotorState) -> None:
        self._state, self.position, self.velocity = state, state[0], state[1]
        self.up, self._forces = rotate(state[3], UP), quadratic(self._model.thrust, state[5])
        self.thrust = whole(self._forces) / self._most


def make_vehicle(p: Parameters) -> Vehicle:
    """Return a vehicle: by the fitted model if it has one."""
    if p.fitted is not None:
        return FittedVehicle(p, p.fitted)
    if p.rotors is not None:
        return RotorVehicle(p, p.rotors)
    raise ValueError("neither a fitted model nor rotors")
