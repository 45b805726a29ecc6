"""Flies one drone: phases, staleness ladder, position hold, safety filter, report.

A follower's agent and the flying leader use it; only the desired velocity in formation is their own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, Final, cast

from flockwire_core.control.airframe.state import LEVEL, VERTICAL, WHOLE, AirframeState
from flockwire_core.control.free_place import meets
from flockwire_core.control.guard import Guard
from flockwire_core.domain.airframe import Command, FlightState, Telemetry
from flockwire_core.domain.body import Body
from flockwire_core.domain.motion import Motion
from flockwire_core.domain.order import Stop
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.domain.vector import ZERO, Vector, limit, scale, subtract
from flockwire_core.objects import load_object
from flockwire_core.parameters import PilotParameters
from flockwire_core.pilot.off_place import OffPlace, no_place
from flockwire_core.pilot.phases import IN_FLIGHT, NEVER, FlightPhases, age, began, command_stamp
from flockwire_core.pilot.reactions import BLIND, SILENT, SLOW, Reactions
from flockwire_core.pilot.surroundings import Surroundings
from flockwire_core.pilot.tracked_body import TrackedBody, foreign, obeys
from flockwire_core.pilot.wanted import CROWDED, Place
from flockwire_core.swarm.model import uav
from flockwire_core.wire.codec import Message
from flockwire_core.wire.keys import STOP, Key
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.status import CORNERED, Reason, Report, counted

NO_TELEMETRY: Final = Telemetry(0, "", FlightState.GROUNDED, 1.0, 0.0, -1.0)  # before the first
AIRBORNE: Final = frozenset({FlightState.FLYING, FlightState.LANDING})
NO_WAY: Final = Reason(CORNERED, "no velocity within its limits avoids a person", "keep persons away from it")
DISTURBED: Final = "flockwire_core.control.airframe.disturbance:DisturbedAirframe"  # which few swarms have
DRIVER_LOST = 10.0  # s of silence after which a driver counts as dead
LEARNED: Final = {Phase.TAKEOFF: LEVEL, Phase.HOLD: WHOLE, Phase.FORMATION: WHOLE, Phase.LANDING: WHOLE}


class Pilot:
    """Flies one drone, started at `now` (Unix ns). Each step is one `observe`, then one `command`.

    Between the two, `motion` (None while the pose is stale), `bodies` (nearby, relative to it), `stamp` (Unix ns, of
    the command), `dt` (s since the last step) and the phase of `flight` are valid. If `parameters.filtered`, the safety
    filter limits every command in flight; else (law "paper") commands are not filtered.
    """

    def __init__(self, parameters: PilotParameters, now: int) -> None:
        number = parameters.number
        self.pose_key = Key("pose", uav(number))
        self.born = now  # ages of what never arrived count from it
        self._parameters, self._limits = parameters, parameters.limits
        self._reactions = Reactions(parameters.limits, parameters.driver, parameters.leaders, parameters.relays)
        self._found: dict[str, Reason] = {}  # the reasons for the reactions of this step
        self.flight = FlightPhases(now)
        self.motion: Motion | None = None
        self.bodies: Sequence[Body] = ()
        self.stamp, self.dt = now, 0.0
        self._command_key = Key("command", uav(number))
        self._guard = Guard(parameters.guard) if parameters.filtered else None
        self._off_place = OffPlace(parameters.guard.room, parameters.checks)
        self._wanted = ZERO  # m/s, by the law, at the last command
        self.sent = ZERO  # m/s, the last command as filtered
        self.accelerates = False  # whether commands in formation say how they change
        self.commanded = 0  # steps of the formation phase with the safety filter
        self.filtered = 0  # those in which it changed the command, but for its limits of speed and acceleration
        self.conflicts = 0  # of those, in which it did so for drones and people alone
        self._airframe = _make_airframe(parameters)
        self._body = TrackedBody(parameters, self._airframe, now)
        self._surroundings = Surroundings(parameters.sensing, parameters.obstacles)
        self._telemetry = NO_TELEMETRY
        self._place = Place(parameters)  # the place of hold or take-off
        self._stepped = now
        self._woke = self._retired = self._down_since = 0  # when a pause, it and the leader ended, Unix ns; 0: never
        self._waited = self._stood = 0.0  # s that this landing has waited for poses, and had poses on the ground
        self.handlers: dict[Key, Callable[[Any], None]] = {  # of messages, by key
            self.pose_key: self._take_pose,
            Key("nearby", uav(number)): self._surroundings.take_nearby,
            Key("telemetry", uav(number)): self._take_telemetry,
            STOP: self._take_stop,
        }

    def observe(
        self,
        now: int,
        silence: float,
        missing: tuple[int, ...],
        failure: str,
        neighbours: Callable[[], list[Vector]],
        leader_down: bool = False,
    ) -> Phase:
        """Update the phase and the nearby bodies at `now` (Unix ns); returns the phase.

        The newest leader estimate is `silence` s old, the neighbours `missing` have none; `failure` forbids the
        formation (empty: none); `neighbours` returns the positions known without a sensor (m, world frame);
        `leader_down`: the leader does not lead.
        """
        pause, self._stepped = now - self._stepped, now
        self.dt = min(pause / SECOND, 0.1)  # s: longer pauses count as this
        if pause > SECOND // 4:  # ns between two steps after which it was frozen
            self._woke = now
        pose, was = self._body.last, self.flight.phase
        values = self._values(now, pause, silence, leader_down, len(missing), bool(failure))
        self._found = found = self._reactions.find(values, was, failure, missing)
        self.stamp = command_stamp(pose, now, self._limits.staleness.pose_zero)
        high = pose is not None and self._place.is_high(pose.position)
        phase = self.flight.update(now, self._telemetry.state in AIRBORNE, high, found)
        if phase is not was:  # a new phase has its own place
            self._place.forget()
            self._waited = self._stood = 0.0
            if was is Phase.TAKEOFF:
                self._body.took_off(now)
        self.motion, self.bodies = None, ()
        if pose is not None:
            self.bodies = self._surroundings.bodies(pose, neighbours)
            if BLIND not in found:
                self.motion = motion = self._measure(pose, phase, now)
                self._body.way = subtract(motion.stopping, motion.position)
                if self._guard is not None and phase in IN_FLIGHT:
                    self.bodies = self._guard.tracked(motion, self.bodies, self._sensed_at)
        if now >= self._body.due:
            self._body.look(self.motion, self._telemetry, phase, now)
        return phase

    @property
    def _sensed_at(self) -> int:
        """When the bodies were seen, Unix ns."""
        return self._surroundings.stamp or self.stamp

    def command(self, wanted: Vector, now: int) -> list[tuple[Key, Message]]:
        """Return the command to publish at `now` (Unix ns); `wanted` (m/s) is used only in the formation phase.

        None after an emergency stop, and while it is not known whether the drone flies: without commands it then lands
        instead of hovering without end.
        """
        if self.flight.phase is Phase.STOPPED or SILENT in self._found:
            self.sent = ZERO
            return []
        motion = self.motion
        self._wanted = wanted
        velocity = self._velocity(wanted, motion, now) if motion is not None else self._blind_velocity(now)
        last, acceleration = self._airframe.last_command, ZERO
        forms = motion is not None and self.flight.phase is Phase.FORMATION
        if forms and self._guard is not None:
            self.commanded += 1
            self.filtered += self._guard.is_held
            self.conflicts += self._guard.is_held and not self._guard.is_held_by_fixed
        if forms and self.accelerates and self.dt > 0.0:
            acceleration = scale(subtract(velocity, last), 1.0 / self.dt)
        self.sent = velocity
        velocity = self._airframe.command(velocity, (now - self.born) / SECOND)
        return [(self._command_key, Command(self.stamp, self._parameters.frame, velocity, 0.0, acceleration))]

    def report(
        self, now: int, formation_error: float = -1.0, estimate_age: float = -1.0, place: Vector | None = None
    ) -> Report:
        """Return the drone's status; `formation_error` in m, `estimate_age` in s, -1 if there is none.

        `place` is that in the formation, m, None if unknown.
        """
        telemetry, flight = self._telemetry, self.flight
        counts = counted(("poses refused", self._body.refused))
        if self._guard is not None and self._guard.cornered:
            counts = (*counts, (CORNERED, self._guard.cornered))
        return Report(
            flight.phase, flight.reason.text, formation_error,
            shown(age(self._body.seen, now)),
            estimate_age,
            shown(age(self._surroundings.stamp, now)),
            shown(age(telemetry.stamp, now)),
            telemetry.battery if telemetry.stamp else -1.0,
            flight.mission,
            counts=counts,
            position=self._body.place,
            unnumbered=flight.orders.unnumbered,
            order_age=flight.orders.age(now),
            reasons=tuple(self._reasons(now, formation_error, place)),
            code=flight.reason.code,
        )  # fmt: skip

    def _reasons(self, now: int, formation_error: float, place: Vector | None) -> Iterator[Reason]:
        """Yield what else the status reports, besides the reason of the phase."""
        phase, guard = self.flight.phase, self._guard
        motion = self.motion if phase is Phase.FORMATION else None
        if motion is None:
            self._off_place.forget()
        if self._body.why:
            yield foreign(self._body.why)
        elif motion is not None:
            own, given = self._parameters.guard, self._airframe.last_command
            taken = None
            if place is not None:
                taken = no_place(place, motion.position, self.bodies, own.separation, own.room)
            yield from self._off_place.reasons(formation_error, motion.position, self._wanted, given, now, taken)
        if guard is not None and guard.is_cornered and phase in IN_FLIGHT:
            yield NO_WAY
        if self._place.crowded:
            yield CROWDED

    def _values(
        self, now: int, pause: int, silence: float, leader_down: bool, missing: int, failure: bool
    ) -> list[float]:
        """Return the values of the INPUTS at `now` (Unix ns), in their order."""
        mission, telemetry, last = self.flight.mission, self._telemetry, self._body.last
        place, seen = (last.position, last.stamp) if last is not None else (None, 0)
        self._down_since = began(self._down_since, leader_down and self._follows(), now)
        pose_age, telemetry_age, state = age(seen, now), age(telemetry.stamp, now), telemetry.state
        low = place is not None and place[2] <= self._parameters.ground + 0.1  # m above the ground: it may stand there
        if low and self.flight.phase is Phase.LANDING:
            self._stood += self.dt
        return [
            _lasting(self._retired, now),
            float(mission is not None and self._parameters.number in mission.without),
            float(failure),
            float(state is FlightState.HELD),
            NEVER if self._body.why else pose_age,
            min(pose_age, age(self.born, now)),
            silence,
            _lasting(self._down_since, now),
            float(missing),
            self._surroundings.age(now),
            telemetry_age,
            telemetry.battery,
            self._parameters.guard.room.outside(place) if place is not None else 0.0,
            float(state is FlightState.LANDING),
            pause / SECOND,
            (now - self._woke) / SECOND,
            _lasting(self.born, now) if mission is None else 0.0,
            self._stood if low else 0.0,
            telemetry_age if low else 0.0,
        ]

    def _follows(self) -> bool:
        mission = self.flight.mission
        return mission is not None and mission.in_formation and self.flight.phase in IN_FLIGHT

    def retire(self, now: int) -> None:
        """Hold, then land, because the process must end."""
        self._retired = self._retired or now

    def may_end(self, now: int) -> bool:
        """Return whether the drone is down, or its driver has been silent for long and obeys no more."""
        return self._telemetry.state not in AIRBORNE or age(self._telemetry.stamp, now) > DRIVER_LOST

    def _measure(self, pose: Pose, phase: Phase, now: int) -> Motion:
        """Return the motion at `now` by a fresh `pose`; learn the disturbance of the airframe where it flies freely.

        In a take-off only the horizontal part is learned; near the end of a landing the vertical one, as the ground
        would hold the drone beside its place. Nothing is learned while the driver obeys no commands.
        """
        airframe, learned = self._airframe, LEARNED.get(phase)
        if phase not in IN_FLIGHT:
            airframe.reset()
        # m above the ground, below which it may hold a drone that lands
        elif phase is Phase.LANDING and pose.position[2] < self._parameters.ground + 0.3:
            learned = VERTICAL
        if not obeys(self._telemetry, self._limits.staleness.command_zero):
            learned = None
        seen = (pose.stamp - self.born) / SECOND  # small enough for a float with nanoseconds
        return airframe.measure(pose.position, seen, (now - self.born) / SECOND, learned)

    def _velocity(self, wanted: Vector, motion: Motion, now: int) -> Vector:
        """Return the velocity command for a fresh pose."""
        position, limits, phase = motion.position, self._limits, self.flight.phase
        if phase not in IN_FLIGHT:
            return ZERO
        if phase is Phase.LANDING:
            self._airframe.limit_vertical(limits.vertical_speed)  # what it compensates lets it descend
        if phase is not Phase.FORMATION:
            wanted = self._place.velocity(phase, position, self.bodies)
        slow, most = SLOW in self._found, self._parameters.guard.speed
        most = min(most, limits.blind_speed) if slow else most
        speed = self._airframe.speed(most)
        if phase is Phase.LANDING:  # it descends in a wind that is as fast as its airframe
            speed = max(speed, min(most, limits.vertical_speed))
        grounding = phase in (Phase.LANDING, Phase.TAKEOFF)
        if self._guard is not None:
            last, seen = self._airframe.last_command, self._sensed_at
            return self._guard.velocity(wanted, motion, self.bodies, seen, now, last, self.dt, speed, grounding)
        return wanted if grounding else limit(self._parameters.guard.room.inwards(wanted, position), speed)

    def _blind_velocity(self, now: int) -> Vector:
        """Return the velocity command without a fresh pose: straight down in a landing, or beneath a body, else zero.

        A drone above may descend at any time, as its driver does without commands. Above another body a drone waits
        first, until a driver below that has no commands lands its drone too, but between two no longer than that.
        A landing waits once in all, however often its pose is lost.
        """
        phase, stale = self.flight.phase, self._limits.staleness
        airframe, descent = self._airframe, self._limits.vertical_speed
        if phase not in IN_FLIGHT:
            airframe.reset()  # what was learned in flight would take off again
            return ZERO
        beneath = meets(self.bodies, self._parameters.guard.separation, above=True)
        if phase is not Phase.LANDING and not beneath:
            return ZERO
        waits = self._waits(stale.command_land if beneath else max(stale.pose_land, stale.command_land), now)
        if waits and phase is not Phase.LANDING:
            return ZERO
        if self._stood:
            airframe.reset()  # what it compensates would push it along the ground
        airframe.limit_vertical(0.5 * descent)  # so it descends at half of it or more
        if not waits:
            self._body.sunk += descent * self.dt
            return (0.0, 0.0, -descent)
        self._waited += self.dt
        return (0.0, 0.0, min(0.0, airframe.disturbance[2]))  # the wind that it compensates may have ended

    def _waits(self, patience: float, now: int) -> bool:
        """Return whether it is above another body without a pose, for no longer than `patience`, s."""
        last = self._body.last
        recent = last is not None and now - last.stamp <= nanoseconds(patience) and self._waited <= patience
        return recent and not self._stood and meets(self.bodies, self._parameters.guard.separation, above=False)

    def _take_pose(self, pose: Pose) -> None:
        if not self._body.take(pose, self.flight.phase):
            self._surroundings.drop(pose.stamp)

    def _take_telemetry(self, telemetry: Telemetry) -> None:
        self._telemetry = telemetry

    def _take_stop(self, _: Stop) -> None:
        self.flight.stop()


def _lasting(since: int, now: int) -> float:
    """Return the time, s, above 0, for which what began at `since` lasts; 0 if that is 0."""
    return max((now - since) / SECOND, 1e-9) if since else 0.0


def shown(age: float) -> float:
    """Return an age for a status: -1 for an input that never arrived."""
    return -1.0 if age == NEVER else age


def _make_airframe(parameters: PilotParameters) -> AirframeState:
    """Return what follows the airframe; it estimates a disturbance only if it may compensate one."""
    lag, dead_time, most = parameters.lag, parameters.dead_time, parameters.disturbance
    if not most:
        return AirframeState(lag, dead_time)
    return cast("AirframeState", load_object(DISTURBED)(lag, dead_time, most, parameters.guard.speed))
