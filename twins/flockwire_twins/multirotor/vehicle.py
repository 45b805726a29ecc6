"""A multirotor with its autopilot, by the fitted model or with rotors: velocity and heading in, motion out."""

from __future__ import annotations

from math import asin, atan2, cos, sin

from flockwire_core.domain.pose import LEVEL, wrapped, yaw_of
from flockwire_core.domain.quaternion import Quaternion, rotate
from flockwire_core.domain.vector import ZERO, Vector, norm, scale

from flockwire_twins.multirotor import fitted, rotors
from flockwire_twins.multirotor.autopilot import RotorLoop, VelocityLoop
from flockwire_twins.multirotor.fitted import UP, FittedModel
from flockwire_twins.multirotor.parameters import Fitted, Parameters, Rotors
from flockwire_twins.multirotor.rotors import Four, RotorModel, RotorState, times, whole
from flockwire_twins.simulated_airframe import Wear


class Vehicle:
    """The common part; `thrust` is a share of the most."""

    def __init__(self, p: Parameters) -> None:
        self.wear = Wear()
        self.loop = VelocityLoop(p)
        self.position, self.velocity, self.orientation, self.thrust = ZERO, ZERO, LEVEL, 0.0
        self.up = UP
        self._mass, self._most = p.mass_kg, 4.0 * p.thrust_n[1]
        gain = p.fitted.thrust_gain if p.fitted is not None else 1.0
        self._bounds = (4.0 * p.thrust_n[0] * gain / p.mass_kg, self._most * gain / p.mass_kg)

    def stand(self, position: Vector, yaw: float, spins: bool) -> None:
        """Stand level at `position` (m, world) with the heading `yaw` (rad); its rotors stop, or spin as they do."""
        raise NotImplementedError

    def rest(self, position: Vector) -> None:
        """Stop at `position`, as it lies."""
        raise NotImplementedError

    def fly(
        self, wanted: Vector, change: Vector, yaw: float, wind: Vector, lift: float, voltage: float, motors: bool
    ) -> None:
        """Fly a step towards `wanted` (m/s), which changes by `change` (m/s²), and `yaw` (rad).

        `lift` and `voltage` are shares of the usual ones.
        """
        raise NotImplementedError

    def _wanted(self, wanted: Vector, change: Vector, acceleration: Vector, acting: Vector, voltage: float) -> Vector:
        self.loop.gain, (least, most) = self.wear.gains, self._bounds
        return self.loop.thrust(wanted, change, self.velocity, acceleration, acting, (least, most * voltage * voltage))


class FittedVehicle(Vehicle):
    """One by the fitted model."""

    def __init__(self, p: Parameters, f: Fitted) -> None:
        super().__init__(p)
        (a, c), (ay, cy) = f.tilt_per_s2, f.yaw_per_s2
        tilt, yaw = (a, f.tilt_damping_per_s, c), (ay, f.yaw_damping_per_s, cy)
        self._gain = f.thrust_gain
        self._model = FittedModel(p.mass_kg, p.drag_kg_per_s, tilt, yaw, f.thrust_gain, f.thrust_lag_s, p.step_s)
        self._state = fitted.standing(ZERO, 0.0)

    def stand(self, position: Vector, yaw: float, spins: bool) -> None:
        """Stand level."""
        self._show(fitted.standing(position, yaw, self._state.thrust if spins else 0.0))
        self.loop.reset()

    def rest(self, position: Vector) -> None:
        """Stop as it lies."""
        s = self._state
        self._show(fitted.FittedState(position, ZERO, ZERO, s.roll, s.pitch, s.yaw, s.up, 0.0))

    def fly(
        self, wanted: Vector, change: Vector, yaw: float, wind: Vector, lift: float, voltage: float, motors: bool
    ) -> None:
        """Fly a step."""
        s, wear = self._state, self.wear
        command: Quaternion = (0.0, 0.0, 0.0, 0.0)
        if motors:
            f = self._wanted(wanted, change, s.acceleration, scale(s.up, self._gain * s.thrust / self._mass), voltage)
            size, heading, model = norm(f), s.yaw[0], self._model
            c, n = cos(heading), sin(heading)
            forward, left = c * f[0] + n * f[1], c * f[1] - n * f[0]
            roll, pitch = -asin(left / size) / model.tilt_gain, atan2(forward, f[2]) / model.tilt_gain
            command = (roll, pitch, yaw / model.yaw_gain, self._mass * size / self._gain)
        self._show(self._model.flown(s, command, wind, wear.mass, lift * whole(wear.rotors) / 4.0))

    def _show(self, state: fitted.FittedState) -> None:
        self._state, self.position, self.velocity, self.up = state, state.position, state.velocity, state.up
        self.orientation = fitted.quaternion(state.roll[0], state.pitch[0], state.yaw[0])
        self.thrust = state.thrust / self._most


class RotorVehicle(Vehicle):
    """One from first principles."""

    def __init__(self, p: Parameters, r: Rotors) -> None:
        super().__init__(p)
        self._torque, self._inertia = r.torque_per_rpm, r.inertia_kg_m2
        self._attitude = RotorLoop(p.autopilot, r, p.thrust_n, p.step_s)
        self._model = RotorModel(
            p.mass_kg, p.drag_kg_per_s, r.arm_m, r.inertia_kg_m2, r.damping_n_m_s, r.thrust_per_rpm, r.torque_per_rpm,
            r.faster_per_s, r.slower_per_s, r.propeller_kg_m2, p.step_s,
        )  # fmt: skip
        self._speeds: Four = (0.0, 0.0, 0.0, 0.0)
        self._forces = self._speeds  # N, of each rotor
        self._state = RotorState(ZERO, ZERO, ZERO, LEVEL, ZERO, self._speeds)

    def stand(self, position: Vector, yaw: float, spins: bool) -> None:
        """Stand level."""
        q, speeds = fitted.quaternion(0.0, 0.0, yaw), self._state.speeds
        speeds = speeds if spins else (0.0, 0.0, 0.0, 0.0)
        self._show(RotorState(position, ZERO, ZERO, q, self._model.momentum(q, ZERO, speeds), speeds))
        self.loop.reset()
        self._attitude.reset()

    def rest(self, position: Vector) -> None:
        """Stop as it lies."""
        q, still = self.orientation, (0.0, 0.0, 0.0, 0.0)
        self._show(RotorState(position, ZERO, ZERO, q, ZERO, still))

    def fly(
        self, wanted: Vector, change: Vector, yaw: float, wind: Vector, lift: float, voltage: float, motors: bool
    ) -> None:
        """Fly a step."""
        s, wear, command = self._state, self.wear, self._speeds
        if motors:
            f = self._wanted(wanted, change, s.acceleration, scale(self.up, whole(self._forces) / self._mass), voltage)
            size, (jx, jy, jz) = norm(f), self._inertia
            tx, ty, tz = self._model.torques(self._forces, rotors.quadratic(self._torque, s.speeds), ZERO)
            acting = (tx / jx, ty / jy, tz / jz)  # as it believes: of undamaged rotors, without damping
            command = self._attitude.speeds(
                scale(f, 1.0 / size), self._mass * size, wrapped(yaw - yaw_of(s.orientation)), s.orientation,
                self._model.rates(s.orientation, s.momentum, s.speeds), acting, s.speeds, voltage,
            )  # fmt: skip
        shares = times(wear.rotors, (lift, lift, lift, lift))
        self._show(self._model.flown(s, command, wind, wear.mass, shares))

    def _show(self, state: RotorState) -> None:
        self._state, self.position, self.velocity = state, state.position, state.velocity
        self.orientation, self.up = state.orientation, rotate(state.orientation, UP)
        self._forces = self._model.forces(state.speeds)
        self.thrust = whole(self._forces) / self._most


def make_vehicle(p: Parameters) -> Vehicle:
    """Return a vehicle: by the fitted model if it has one."""
    if p.fitted is not None:
        return FittedVehicle(p, p.fitted)
    if p.rotors is not None:
        return RotorVehicle(p, p.rotors)
    raise ValueError("neither a fitted model nor rotors")
