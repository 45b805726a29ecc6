"""Flies one drone to identify its airframe: take-off, steps along each axis in turn, landing.

It replaces the drone's pilot, with the same phases, staleness ladder and safety filter. The excited axis has no
control, to separate cause and effect; the drone is held in place along the others.
"""

from __future__ import annotations

from collections.abc import Iterable
from enum import StrEnum
from math import cos, sin

from flockwire_core.domain.airframe import Command, Telemetry
from flockwire_core.domain.order import Mission
from flockwire_core.domain.pose import Pose, wrapped, yaw_of
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import ZERO, Vector, add, scale, subtract
from flockwire_core.parameters import pilot_parameters
from flockwire_core.pilot.pilot import Pilot
from flockwire_core.pilot.wanted import keep_place
from flockwire_core.swarm.model import Swarm
from flockwire_core.wire.codec import Message
from flockwire_core.wire.keys import Key
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.status import Report

from flockwire_operator.station.identification import StepResponse

SHORT, LONG = (((seconds, 1.0), (2.0 * seconds, -1.0), (seconds, 1.0)) for seconds in (0.5, 1.0))  # s, sign
PULSES = SHORT * 2 + LONG * 2  # short ones for the dead time, long ones for the gain; each ends at its start
EXCITED = sum(duration for duration, _ in PULSES)  # s
STEP = 0.3  # m/s
MOST_INTERRUPTIONS = 5  # holds, by the staleness ladder, that it tolerates
ROSE, NOT_ROSE = 0.6, 0.25  # m, of a drone by its own sensors, and of its body at the tracker
OTHER_BODY = "the drone climbs, but its body at the tracker does not: does the body belong to another drone?"
PATIENCE = 60.0  # s to wait for poses, telemetry and take-off


class Axis(StrEnum):
    """The excited axis, with the name of its stick."""

    FORWARD = "forward"
    RIGHT = "right"
    UP = "up"
    CLOCKWISE = "clockwise"


class ExcitationStage(StrEnum):
    """The stage of the identification."""

    WAITING = "waiting"
    RESTING = "resting"
    EXCITING = "exciting"
    LANDING = "landing"
    DONE = "done"


class ExcitationCore:
    """The pilot of drone `number` of `swarm` while it is identified, started at `now` (Unix ns).

    It excites `axes`, without yaw if the airframe cannot turn. When `stage` is DONE, `responses` has the measurements,
    and `failure` the reason for missing ones (empty if complete).
    """

    def __init__(self, swarm: Swarm, number: int, now: int, axes: Iterable[Axis] = Axis) -> None:
        self._pilot = pilot = Pilot(pilot_parameters(swarm, number), now)
        self.triggers = frozenset({pilot.pose_key})
        self.prompt: frozenset[Key] = frozenset()
        self.period = 1.0 / swarm.control.rate_hz
        self.stage, self.failure = ExcitationStage.WAITING, ""
        self.responses: dict[Axis, StepResponse] = {}
        self._frame, self._speed = swarm.frame, swarm.limits.vertical_speed
        self._left = [axis for axis in axes if axis is not Axis.CLOCKWISE or swarm.row(number).turns]
        self._since = now
        self._interruptions = 0
        self._ground: float | None = None  # start of the tracked body, m
        self._height = 0.0  # of the tracked body above that, m
        self._place: Vector | None = None
        self._direction, self._turn = ZERO, 0.0  # of the excited axis: a unit vector, or a share of the yaw
        self._yaw = 0.0  # of the newest pose, not wrapped
        self._changes: list[tuple[float, float]] = []
        self._track: list[tuple[float, float]] = []

    def receive(self, key: Key, message: Message, now: int) -> None:
        """Receive a message of its drone; orders are ignored."""
        self._pilot.handlers.get(key, lambda _: None)(message)
        if isinstance(message, Telemetry):
            high = self.stage is ExcitationStage.WAITING and message.height > ROSE
            if high and self._height < NOT_ROSE:  # by its own sensors, but not at the tracker
                self._fail(OTHER_BODY, now)
        if isinstance(message, Pose) and key == self._pilot.pose_key:
            self._ground = message.position[2] if self._ground is None else self._ground
            self._height = message.position[2] - self._ground
            self._yaw += wrapped(yaw_of(message.orientation) - self._yaw)
            if self.stage is ExcitationStage.EXCITING and self._place is not None:
                moved = self._along(subtract(message.position, self._place), self._yaw)
                self._track.append(((message.stamp - self._pilot.born) / SECOND, moved))

    def step(self, now: int) -> list[tuple[Key, Message]]:
        """Advance the stage, and command."""
        pilot = self._pilot
        phase = pilot.observe(now, 0.0, (), "", list)
        lasted = (now - self._since) / SECOND
        match self.stage:
            case ExcitationStage.WAITING:
                self._rise(phase, lasted, now)
            case ExcitationStage.RESTING | ExcitationStage.EXCITING:
                self._measure(phase, lasted, now)
            case ExcitationStage.LANDING if phase in (Phase.GROUNDED, Phase.READY, Phase.STOPPED):
                self._enter(ExcitationStage.DONE, now)
        sign = self._sign(now)
        return [(key, self._turned(message, sign, now)) for key, message in pilot.command(self._wanted(sign), now)]

    def retire(self, now: int) -> None:
        """Land, because the process must end."""
        self._pilot.retire(now)
        self._fail("it was ended", now)

    def may_end(self, now: int) -> bool:
        """Return whether the drone is down."""
        return self._pilot.may_end(now)

    def report(self, now: int) -> Report:
        """Return its status."""
        moves = self.stage in (ExcitationStage.RESTING, ExcitationStage.EXCITING)
        axis = f" {self._left[0]}" if self._left and moves else ""
        waits = f": {self._pilot.flight.reason.text}" if self._pilot.flight.reason.text else ""
        return self._pilot.report(now)._replace(phase=self.stage, detail=f"{self._pilot.flight.phase}{axis}{waits}")

    def _rise(self, phase: Phase, lasted: float, now: int) -> None:
        verb = {Phase.READY: "takeoff", Phase.HOLD: "start"}.get(phase)
        if verb is not None:
            self._order(verb, now)
        elif phase is Phase.FORMATION:
            self._enter(ExcitationStage.RESTING, now)
        elif lasted > PATIENCE:
            self._fail(f"still {phase} after {PATIENCE:.0f} s: {self._pilot.flight.reason.text}", now)

    def _measure(self, phase: Phase, lasted: float, now: int) -> None:
        rest = 3.0  # s at the place, before each axis
        excites = self.stage is ExcitationStage.EXCITING
        if phase is Phase.HOLD and self._interruptions < MOST_INTERRUPTIONS:
            self._interruptions += excites
            self._enter(ExcitationStage.RESTING, now)  # the axis restarts when all inputs are fresh
        elif phase is not Phase.FORMATION:
            self._fail(f"{phase}: {self._pilot.flight.reason.text or 'on the ground'}", now)
        elif excites and lasted >= EXCITED:
            self.responses[self._left.pop(0)] = StepResponse(tuple(self._changes), tuple(self._track))
            self._enter(ExcitationStage.RESTING if self._left else ExcitationStage.LANDING, now)
        elif not excites and lasted >= rest:
            self._begin(now)

    def _begin(self, now: int) -> None:
        axis, c, s = self._left[0], cos(self._yaw), sin(self._yaw)
        ways = {Axis.FORWARD: (c, s, 0.0), Axis.RIGHT: (s, -c, 0.0), Axis.UP: (0.0, 0.0, 1.0)}
        self._direction, self._turn = ways.get(axis, ZERO), -1.0 if axis is Axis.CLOCKWISE else 0.0
        self._changes, self._track = [], []
        self._enter(ExcitationStage.EXCITING, now)

    def _enter(self, stage: ExcitationStage, now: int) -> None:
        if stage is ExcitationStage.RESTING and self._place is None and self._pilot.motion is not None:
            self._place = self._pilot.motion.position
        if stage is ExcitationStage.LANDING:
            self._order("land", now)
        self.stage, self._since = stage, now

    def _fail(self, reason: str, now: int) -> None:
        self.failure = self.failure or reason
        if self.stage not in (ExcitationStage.LANDING, ExcitationStage.DONE):
            self._enter(ExcitationStage.LANDING, now)

    def _order(self, verb: str, now: int) -> None:
        mission = self._pilot.flight.mission
        if mission is None or mission.verb != verb:
            order = Mission(now, self._frame, verb, now, number=self._pilot.flight.orders.number + 1)
            self._pilot.flight.order(order, now)

    def _sign(self, now: int) -> float:
        """Return the direction of the current pulse, 0 without one."""
        lasted = (now - self._since) / SECOND
        if self.stage is ExcitationStage.EXCITING:
            for duration, sign in PULSES:
                if lasted < duration:
                    return sign
                lasted -= duration
        return 0.0

    def _wanted(self, sign: float) -> Vector:
        motion, place, along = self._pilot.motion, self._place, self._direction
        if motion is None or place is None:
            return ZERO
        holding = keep_place(motion.stopping, place, self._speed)
        if self.stage is not ExcitationStage.EXCITING:
            return holding
        return add(subtract(holding, scale(along, _dot(holding, along))), scale(along, STEP * sign))

    def _turned(self, message: Message, sign: float, now: int) -> Message:
        """Return and record a command with the current yaw rate."""
        yaw_step = 0.6  # rad/s
        resolution = 1e-4  # m/s, of recorded commands: the control of the other axes leaks into them by rounding
        if self.stage is not ExcitationStage.EXCITING or not isinstance(message, Command):
            return message
        message = message._replace(yaw_rate=message.yaw_rate + yaw_step * self._turn * sign)
        value = round(self._along(message.velocity, message.yaw_rate) / resolution) * resolution
        if not self._changes or value != self._changes[-1][1]:
            self._changes.append(((now - self._pilot.born) / SECOND, value))
        return message

    def _along(self, vector: Vector, yaw: float) -> float:
        """Return the share of a motion, or of a velocity, along the excited axis."""
        return _dot(vector, self._direction) + self._turn * yaw


def _dot(a: Vector, b: Vector) -> float:
    return sum(x * y for x, y in zip(a, b, strict=True))
