"""A follower's agent without clock, input or output: it observes the leader, flies the formation, keeps clear."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import dist
from typing import Any

from flockwire.control.airframe_state import AirframeState, Motion
from flockwire.control.vector import ZERO, Vector, add, limit, scale
from flockwire.flight.avoidance import repulsion
from flockwire.flight.cores import Start
from flockwire.flight.guard import Guard
from flockwire.flight.ladder import Inputs, all_well, hold_reason, land_reason, shown, speed_limit, unready_reason
from flockwire.flight.phases import (
    IN_FLIGHT,
    NEVER,
    Flight,
    Phase,
    Situation,
    age,
    climb,
    command_stamp,
    fenced,
    keep_place,
    outside,
)
from flockwire.flight.surroundings import Surroundings
from flockwire.law import Decision, Law, Observation, Reference, check_decision
from flockwire.loading import load_law
from flockwire.nanoseconds import BILLION
from flockwire.swarm.model import Swarm, uav
from flockwire.wire.keys import MISSION, STOP, Key
from flockwire.wire.messages import Body, Command, Estimate, FlightState, Message, Mission, Pose, Stop, Telemetry
from flockwire.wire.status import Report

from flockwire_agent.neighbourhood import Neighbourhood

AIRBORNE = frozenset({FlightState.FLYING, FlightState.LANDING})
LONGEST_STEP = 0.1  # s: after a longer pause the observer goes on as if only this had passed


class AgentCore:
    """Follower `number` of `swarm`, started at `now` (Unix ns)."""

    def __init__(self, swarm: Swarm, number: int, now: int) -> None:
        self._pose_key = Key("pose", uav(number))
        self.triggers = frozenset({self._pose_key})
        self.prompt: frozenset[Key] = frozenset()
        self.period = 1.0 / swarm.control.rate_hz
        self._swarm, self._number, self._born = swarm, number, now
        self._limits, self._frame, self._sensing = swarm.limits, swarm.frame, swarm.avoidance.sensing == "nearby"
        self._estimate_key, self._command_key = Key("estimate", uav(number)), Key("command", uav(number))
        self._index = swarm.followers.index(number)
        self._make_law = load_law(swarm.control.law)
        self._law: Law = self._make_law(swarm, number)
        self._fault = ""  # what the law raised
        self._guard = Guard(swarm, number) if swarm.control.filtered else None
        frame = swarm.airframe(number)
        self._airframe = AirframeState(frame.lag, frame.dead_time)
        self._formations = {name: swarm.build_formation(name) for name in ("", *swarm.formations)}
        neighbours = swarm.topology.neighbours(number)
        self._neighbours = len(neighbours)
        self._neighbourhood = Neighbourhood(neighbours, swarm.limits.staleness.estimate_drop)
        self._surroundings = Surroundings(swarm)
        self._flight = Flight(now)
        self._pose: Pose | None = None
        self._telemetry: Telemetry | None = None
        self._place: Vector | None = None  # where it holds, or took off; None until it knows where it is
        self._reference: Reference | None = None  # the place to fly in the formation, None in any other phase
        self._flown: Mission | None = None  # the order that it comes from
        self._stepped = now
        self._judged: tuple[Observation, Decision] | None = None  # what the error is of
        self._take: dict[Key, Callable[[Any], None]] = {  # what to do with a message, by its key
            **{Key("pose", uav(j)): self._neighbourhood.hear_pose(j) for j in neighbours},
            **{Key("estimate", uav(j)): self._neighbourhood.hear_estimate(j) for j in neighbours},
            self._pose_key: self._measured,
            Key("nearby", uav(number)): self._surroundings.see,
            Key("telemetry", uav(number)): self._told,
            MISSION: self._ordered,
            STOP: self._stopped,
        }

    def receive(self, key: Key, message: Message, now: int) -> None:
        """Take in a message; one of a key that is not heard is left out."""
        take = self._take.get(key)
        if take is not None:
            take(message)

    def due(self, key: Key) -> bool:
        """Return True: each own pose calls for a step."""
        return True

    def step(self, now: int) -> list[tuple[Key, Message]]:
        """Observe, decide, command: what to publish at `now`."""
        dt = min((now - self._stepped) / BILLION, LONGEST_STEP)
        self._stepped = now
        since_birth = (now - self._born) / BILLION  # small enough a float to keep the nanoseconds
        pose = self._pose
        heard = self._neighbourhood.heard(now)
        inputs = self._inputs(now)
        stamp, fresh = command_stamp(pose, now, self._limits.staleness.pose_zero)
        self._decide(now, inputs, len(heard))
        motion: Motion | None = None
        bodies: Sequence[Body] = ()
        if pose is not None:
            bodies = self._surroundings.bodies(pose, self._neighbourhood.positions)
            if fresh:
                motion = self._airframe.measure(pose.position, (pose.stamp - self._born) / BILLION, since_birth)
        seen = Observation(dt, stamp, motion, heard, bodies, self._reference)
        decision = self._obey(seen, now)
        velocity = self._velocity(seen, decision, inputs, now) if motion is not None else self._blind_velocity()
        self._airframe.command(velocity, since_birth)
        command = (self._command_key, Command(stamp, self._frame, velocity))
        estimate = decision.estimate
        if estimate is None:
            return [command]
        said = Estimate(decision.stamp or now, self._frame, estimate.position, estimate.velocity, estimate.acceleration)
        return [command, (self._estimate_key, said)]

    def report(self, now: int) -> Report:
        """Return how the agent is."""
        inputs = self._inputs(now)
        nearby = shown(age(self._surroundings.stamp, now))
        return Report(
            self._flight.phase, self._flight.reason, self._error(), shown(inputs.pose),
            shown(self._neighbourhood.oldest(now)), nearby, shown(inputs.telemetry),
            self._telemetry.battery if self._telemetry is not None else -1.0,
        )  # fmt: skip

    def _inputs(self, now: int) -> Inputs:
        pose, telemetry, fence = self._pose, self._telemetry, self._limits.fence
        return Inputs(
            (now - pose.stamp) / BILLION if pose is not None else NEVER,
            self._neighbourhood.silence(now, self._born),
            age(self._surroundings.stamp, now) if self._sensing else 0.0,
            (now - telemetry.stamp) / BILLION if telemetry is not None else NEVER,
            telemetry.battery if telemetry is not None else 1.0,
            outside(pose.position, fence.min, fence.max) if pose is not None else 0.0,
        )

    def _obey(self, seen: Observation, now: int) -> Decision:
        """Return what the law decides; one that raises is not asked again before the next order."""
        self._judged = None
        if self._fault:
            return Decision()
        try:
            decision = self._law.step(seen, now)
            check_decision(decision)
        except Exception as error:
            self._fault = f"the law failed: {type(error).__name__}: {error}"
            return Decision()
        self._judged = seen, decision
        return decision

    def _error(self) -> float:
        """Return the formation error |x_i − h_i − eta_i| of the last step, m; -1 when there is none."""
        if self._judged is None:
            return -1.0
        seen, decision = self._judged
        if decision.estimate is None or seen.motion is None or seen.reference is None:
            return -1.0
        return dist(seen.motion.position, add(seen.reference.offset(seen.stamp), decision.estimate.position))

    def _forgive(self) -> None:
        """Begin the law anew after it failed: a new order came."""
        if self._fault:
            self._fault, self._law = "", self._make_law(self._swarm, self._number)

    def _measured(self, pose: Pose) -> None:
        self._pose = pose

    def _told(self, telemetry: Telemetry) -> None:
        self._telemetry = telemetry

    def _ordered(self, mission: Mission) -> None:
        if mission.formation in self._formations:
            self._flight.order(mission)
            self._forgive()

    def _stopped(self, _: Stop) -> None:
        self._flight.stop()

    def _decide(self, now: int, inputs: Inputs, heard: int) -> None:
        """Go to the phase that follows; `heard` neighbours are fresh."""
        limits, flight, was = self._limits, self._flight, self._flight.phase
        unready = hold = land = ""
        if heard < self._neighbours or not all_well(inputs, limits):
            unready = unready_reason(inputs, self._neighbourhood.missing(now), limits)
            hold = hold_reason(inputs, limits.staleness)
            land = land_reason(inputs._replace(pose=min(inputs.pose, age(self._born, now))), limits)
        airborne = self._telemetry is not None and self._telemetry.state in AIRBORNE
        high = self._pose is not None and self._pose.position[2] >= 0.95 * limits.takeoff_height
        fault = self._fault
        phase = flight.update(Situation(now, fault or unready, fault or hold, land, airborne, high))
        if phase is not was:
            self._place = None
        mission = flight.mission
        if phase is not Phase.FORMATION or mission is None:
            self._reference = None
        elif self._reference is None or mission is not self._flown:
            self._flown = mission
            self._reference = Reference(self._formations[mission.formation], self._index, mission.start)

    def _velocity(self, seen: Observation, decision: Decision, inputs: Inputs, now: int) -> Vector:
        """Return the velocity to command for a fresh pose."""
        assert seen.motion is not None  # noqa: S101  (a fresh pose gives one)
        position, limits, phase = seen.motion.position, self._limits, self._flight.phase
        if phase not in IN_FLIGHT:
            return ZERO
        wanted = self._wanted(phase, position, decision, seen)
        if self._guard is not None:
            grounding = phase in (Phase.LANDING, Phase.TAKEOFF)
            last, speed = self._airframe.last_command, speed_limit(inputs, limits)
            stamp = self._surroundings.stamp or seen.stamp
            return self._guard.velocity(wanted, seen.motion, seen.bodies, stamp, now, last, seen.dt, speed, grounding)
        if phase in (Phase.LANDING, Phase.TAKEOFF):
            return wanted
        return limit(fenced(wanted, position, limits.fence.min, limits.fence.max), speed_limit(inputs, limits))

    def _wanted(self, phase: Phase, position: Vector, decision: Decision, seen: Observation) -> Vector:
        """Return the velocity that the phase asks for."""
        rise = self._limits.vertical_speed
        self._place = self._place or position
        if phase is Phase.FORMATION:
            return decision.velocity
        if phase is Phase.HOLD:
            wanted = keep_place(position, self._place, rise)
            if self._guard is None:
                push = repulsion(seen.bodies, self._swarm.avoidance)
                wanted = add(wanted, scale(push, -self._swarm.control.formation_gain))
            return wanted
        return climb(position, self._place, -rise if phase is Phase.LANDING else rise)

    def _blind_velocity(self) -> Vector:
        """Return the velocity to command without a fresh pose: straight down when landing, else none."""
        landing = self._flight.phase is Phase.LANDING
        return (0.0, 0.0, -self._limits.vertical_speed) if landing else ZERO


def make_core(start: Start) -> AgentCore:
    """Return the core of one follower's agent."""
    return AgentCore(start.plan.swarm, start.drone, start.now)
