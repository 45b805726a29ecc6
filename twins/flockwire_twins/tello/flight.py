"""The flight controller of a simulated Tello: manoeuvres, sticks, battery, sensors.

A manoeuvre, as take-off, landing, waypoints or a turn, gives a velocity until it is done:

    v_u = limit(K (target − position), speed),   omega_u = limit(K_yaw (heading − yaw), rate)
"""

from __future__ import annotations

from collections.abc import Callable
from math import ceil, pi
from typing import NamedTuple

from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.domain.vector import ZERO, Vector, add, limit, norm, scale, subtract
from flockwire_tello.state_string import TelloState
from flockwire_tello.sticks import CENTRED, Sticks, to_body, to_velocity, to_world

from flockwire_twins.tello.airframe import AirframeMotion, TelloAirframe, clockwise_degrees
from flockwire_twins.tello.parameters import Quirk, TelloParameters

CYCLE = SECOND // 50  # of the controller
TAKEOFF_BATTERY = 0.10  # share under which it refuses (user manual: low battery)
LOWEST_TOF, FARTHEST_TOF, NO_TOF = 10, 800, 6553  # cm: on the ground, and without an echo
POSITION_GAIN = 1.2  # 1/s
ARRIVED = 0.03  # m
TURNED = pi / 360.0  # rad
CLIMB = 0.6  # m/s
TURN_RATE = 1.2  # rad/s


class Setpoint(NamedTuple):
    """A command to the airframe: body velocity (FLU, m/s), yaw rate (rad/s, ccw)."""

    velocity: Vector
    yaw_rate: float


HOVER = Setpoint(ZERO, 0.0)

Manoeuvre = Callable[[AirframeMotion, int], Setpoint | None]
"""Returns what to command at a motion and a time (ns); None once it is done."""


class SimulatedFlight:
    """One Tello's flight, from `now` (ns)."""

    def __init__(self, parameters: TelloParameters, now: int) -> None:
        self.airframe = TelloAirframe(parameters, now)
        self.battery = 0.08 if Quirk.LOW_BATTERY in parameters.quirks else parameters.battery  # share
        self.manoeuvre: Manoeuvre | None = None
        self.motor_time = 0.0  # s
        self._parameters = parameters
        self.next_cycle = now  # when `cycle` is due, ns
        self._ground = parameters.position[2]
        self._landing = landing(self._ground, parameters.sink)
        self._sticks, self._sticks_at = CENTRED, now
        self._last = HOVER

    @property
    def flying(self) -> bool:
        """Whether it is in the air, or about to be."""
        return self.airframe.motors and (not self.airframe.standing or self.manoeuvre is not None)

    def take_off(self, now: int) -> None:
        """Take off from the ground."""
        p = self._parameters
        self.airframe.start(now)
        self._sticks = CENTRED
        # of the motors, before it climbs
        self.manoeuvre = taking_off(
            self._ground + p.takeoff_height, now + 4 * SECOND // 5, now + nanoseconds(p.takeoff_time)
        )

    def land(self) -> None:
        """Land; a landing under way continues."""
        self._sticks, self.manoeuvre = CENTRED, self._landing

    def fly(self, points: tuple[Vector, ...], speed: float, now: int) -> None:
        """Fly through `points` (m, forward, left, up from here) at `speed` m/s."""
        motion = self.airframe.motion(now)
        self.manoeuvre = legs([add(motion.position, to_world(point, motion.yaw)) for point in points], speed)

    def turn(self, clockwise: float, now: int) -> None:
        """Turn by an angle, degrees."""
        self.manoeuvre = turning(self.airframe.motion(now).yaw - clockwise * pi / 180.0)

    def pause(self, seconds: float, now: int) -> None:
        """Stay in place."""
        until = now + nanoseconds(seconds)
        self.manoeuvre = lambda motion, at: None if at >= until else HOVER

    def stop(self) -> None:
        """Hover."""
        self.manoeuvre, self._sticks = None, CENTRED

    def cut(self, now: int) -> None:
        """Turn the motors off."""
        self.stop()
        self.airframe.cut(now)

    def sticks(self, sticks: Sticks, now: int) -> None:
        """Set the sticks; they act while there is no manoeuvre."""
        self._sticks, self._sticks_at = sticks, now
        if self.manoeuvre is None and self.airframe.motors:
            self._command(self._by_sticks(now), now)

    def cycle(self) -> bool:
        """Run one cycle of the controller; return whether a manoeuvre was finished."""
        now = self.next_cycle
        self.next_cycle += CYCLE
        self.airframe.advance(now)
        self._drain()
        if not self.airframe.motors:
            return False
        # share under which it lands
        if self.battery <= 0.05 and self.flying and self.manoeuvre is not self._landing:
            self.land()
        return self._control(now)

    def state(self, now: int) -> TelloState:
        """Return the state at `now`, without the mission pad."""
        airframe = self.airframe
        motion, attitude = airframe.motion(now), airframe.attitude(now)
        forward, left, up = to_body(motion.velocity, motion.yaw)
        height = motion.position[2] - self._ground
        below = round(100.0 * height)  # cm
        warm = round(60.0 + 20.0 * self.motor_time / (self.motor_time + 120.0))
        agx, agy, agz = (round(1000.0 * a / 9.81, 2) + 0.0 for a in attitude.specific_force)
        return TelloState(
            pitch=round(attitude.pitch * 180.0 / pi),
            roll=round(attitude.roll * 180.0 / pi),
            yaw=clockwise_degrees(motion.yaw - self._parameters.yaw),
            vgx=round(10.0 * forward),
            vgy=round(-10.0 * left),
            vgz=round(-10.0 * up),
            templ=warm,
            temph=warm + 3,
            tof=max(LOWEST_TOF, below) if below <= FARTHEST_TOF else NO_TOF,
            h=10 * round(10.0 * height),
            bat=ceil(100.0 * self.battery - 1e-9),
            baro=round(160.0 + height, 2),
            time=int(self.motor_time),
            agx=agx,
            agy=agy,
            agz=agz,
        )

    def _control(self, now: int) -> bool:
        """Send the airframe the command of the manoeuvre or the sticks."""
        motion, manoeuvre, done = self.airframe.motion(now), self.manoeuvre, False
        setpoint = self._by_sticks(now) if manoeuvre is None else manoeuvre(motion, now)
        if setpoint is None:
            self.manoeuvre, setpoint, done = None, HOVER, True
            if manoeuvre is self._landing:
                self.cut(now)
                return True
        self._command(setpoint, now)
        return done

    def _command(self, setpoint: Setpoint, now: int) -> None:
        if setpoint != self._last:
            self.airframe.command(setpoint.velocity, setpoint.yaw_rate, now)
            self._last = setpoint

    def _by_sticks(self, now: int) -> Setpoint:
        # without the quirk STICKS_STAY
        if Quirk.STICKS_STAY not in self._parameters.quirks and now - self._sticks_at > SECOND // 2:
            self._sticks = CENTRED
        return Setpoint(*to_velocity(self._sticks, self._parameters.gains))

    def _drain(self) -> None:
        dt, p = CYCLE / SECOND, self._parameters
        self.motor_time += dt if self.airframe.motors else 0.0
        self.battery = max(0.0, self.battery - dt / (p.endurance if self.flying else p.idle_endurance))
        if not self.battery and self.airframe.motors:
            self.cut(self.next_cycle - CYCLE)


def taking_off(height: float, climb: int, until: int) -> Manoeuvre:
    """Run the motors until `climb` (ns), then climb to `height` (m, world z); over at `until` (ns)."""

    def setpoint(motion: AirframeMotion, now: int) -> Setpoint | None:
        if now >= until:
            return None
        speed = max(-CLIMB, min(CLIMB, POSITION_GAIN * (height - motion.position[2])))
        return HOVER if now < climb else Setpoint((0.0, 0.0, speed), 0.0)

    return setpoint


def landing(ground: float, sink: float) -> Manoeuvre:
    """Fly straight down at `sink` m/s, to `ground` (m, world z)."""
    return lambda motion, now: None if motion.position[2] <= ground else Setpoint((0.0, 0.0, -sink), 0.0)


def legs(points: list[Vector], speed: float) -> Manoeuvre:
    """Fly from point to point (m, world frame), at `speed` m/s; it stops only at the last. Removes passed points."""

    def setpoint(motion: AirframeMotion, now: int) -> Setpoint | None:
        to_go = subtract(points[0], motion.position)
        last = len(points) == 1
        if not last and norm(to_go) < speed / POSITION_GAIN:
            points.pop(0)
        elif last and norm(to_go) < ARRIVED and norm(motion.velocity) < ARRIVED:
            return None
        return Setpoint(to_body(limit(scale(to_go, POSITION_GAIN), speed), motion.yaw), 0.0)

    return setpoint


def turning(heading: float) -> Manoeuvre:
    """Turn to a heading (rad, ccw, not wrapped)."""

    def setpoint(motion: AirframeMotion, now: int) -> Setpoint | None:
        to_go = heading - motion.yaw
        if abs(to_go) < TURNED and abs(motion.yaw_rate) < 4.0 * TURNED:
            return None
        return Setpoint(ZERO, max(-TURN_RATE, min(TURN_RATE, 2.5 * to_go)))  # 1/s

    return setpoint
