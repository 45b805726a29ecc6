"""A follower's agent without clock, input or output: it observes the leader, flies the formation, keeps clear."""

from __future__ import annotations

from dataclasses import replace

from flockwire.config import Swarm
from flockwire.control.airframe_state import AirframeState, Motion
from flockwire.control.vector import ZERO, Vector, add, limit, norm, scale, subtract
from flockwire.flight import (
    BILLION,
    IN_FLIGHT,
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
from flockwire.keys import Key, uav
from flockwire.law import Decision, Law, Observation, Reference, check_decision, load_law
from flockwire.messages import Command, Estimate, FlightState, Message, Mission, Nearby, Pose, Report, Stop, Telemetry

from flockwire_agent.avoidance import repulsion
from flockwire_agent.guard import Guard
from flockwire_agent.ladder import Inputs, hold_reason, land_reason, shown, speed_limit, unready_reason
from flockwire_agent.neighbourhood import Neighbourhood
from flockwire_agent.surroundings import Surroundings

LONGEST_STEP = 0.1  # s: after a longer pause the observer goes on as if only this had passed


class AgentCore:
    """Follower `number` of `swarm`, begun at `now` (Unix ns)."""

    def __init__(self, swarm: Swarm, number: int, now: int) -> None:
        self.trigger = Key("pose", uav(number))
        self.prompt: frozenset[Key] = frozenset()
        self.period = 1.0 / swarm.control.rate_hz
        self._swarm, self._number, self._born = swarm, number, now
        self._estimate_key, self._command_key = Key("estimate", uav(number)), Key("command", uav(number))
        self._others = {uav(j): j for j in (0, *swarm.followers)}
        self._index = swarm.followers.index(number)
        self._make_law = load_law(swarm.control.law)
        self._law: Law = self._make_law(swarm, number)
        self._fault = ""  # what the law raised
        self._guard = Guard(swarm, number) if swarm.control.filtered else None
        frame = swarm.airframe(number)
        self._airframe = AirframeState(frame.lag, frame.dead_time)
        self._formations = {name: swarm.build_formation(name) for name in ("", *swarm.formations)}
        self._neighbourhood = Neighbourhood(swarm.topology.neighbours(number), swarm.limits.staleness.estimate_drop)
        self._surroundings = Surroundings(swarm)
        self._flight = Flight(now)
        self._pose: Pose | None = None
        self._telemetry: Telemetry | None = None
        self._place: Vector | None = None  # where it holds, or took off; None until it knows where it is
        self._stepped = now
        self._error = -1.0

    def receive(self, key: Key, message: Message, now: int) -> None:
        """Take in a message."""
        match message:
            case Pose() if key == self.trigger:
                self._pose = message
            case Pose():
                self._neighbourhood.hear_pose(self._others[key.owner], message)
            case Estimate():
                self._neighbourhood.hear_estimate(self._others[key.owner], message)
            case Nearby():
                self._surroundings.see(message)
            case Telemetry():
                self._telemetry = message
            case Mission() if message.formation in self._formations:
                self._flight.order(message)
                self._forgive()
            case Stop():
                self._flight.stop()

    def step(self, now: int) -> list[tuple[Key, Message]]:
        """Observe, decide, command: what to publish at `now`."""
        dt = min((now - self._stepped) / BILLION, LONGEST_STEP)
        self._stepped = now
        heard = self._neighbourhood.heard(now)
        inputs = self._inputs(now)
        stamp, fresh = command_stamp(self._pose, now, self._swarm.limits.staleness.pose_zero)
        self._decide(now, inputs)
        motion = self._motion(now) if fresh else None
        bodies = self._surroundings.bodies(self._pose, self._neighbourhood) if self._pose is not None else ()
        seen = Observation(dt, stamp, motion, heard, bodies, self._reference())
        decision = self._obey(seen, now)
        velocity = self._velocity(seen, decision, inputs, now) if motion is not None else self._blind_velocity()
        self._airframe.command(velocity, now / BILLION)
        messages: list[tuple[Key, Message]] = [(self._command_key, Command(stamp, self._swarm.frame, velocity))]
        if decision.estimate is not None:
            messages.append((self._estimate_key, self._said(decision, now)))
        return messages

    def report(self, now: int) -> Report:
        """Return how the agent is."""
        inputs = self._inputs(now)
        nearby = shown(age(self._surroundings.stamp, now))
        return Report(
            self._flight.phase, self._flight.reason, self._error, shown(inputs.pose),
            shown(self._neighbourhood.oldest(now)), nearby, shown(inputs.telemetry),
            self._telemetry.battery if self._telemetry is not None else -1.0,
        )  # fmt: skip

    def _inputs(self, now: int) -> Inputs:
        pose, telemetry = self._pose, self._telemetry
        sensing = self._swarm.avoidance.sensing == "nearby"
        fence = self._swarm.limits.fence
        return Inputs(
            age(pose.stamp if pose is not None else 0, now),
            self._neighbourhood.silence(now, self._born),
            age(self._surroundings.stamp, now) if sensing else 0.0,
            age(telemetry.stamp if telemetry is not None else 0, now),
            telemetry.battery if telemetry is not None else 1.0,
            outside(pose.position, fence.min, fence.max) if pose is not None else 0.0,
        )

    def _motion(self, now: int) -> Motion:
        """Return the own motion; the pose is fresh."""
        assert self._pose is not None  # noqa: S101  (a fresh pose is one)
        self._airframe.measure(self._pose.position, self._pose.stamp / BILLION)
        return self._airframe.motion(self._pose.position, now / BILLION)

    def _reference(self) -> Reference | None:
        """Return the place to fly in the formation, None in any other phase."""
        mission = self._flight.mission
        if self._flight.phase is not Phase.FORMATION or mission is None:
            return None
        return Reference(self._formations[mission.formation], self._index, mission.start)

    def _obey(self, seen: Observation, now: int) -> Decision:
        """Return what the law decides; one that raises is not asked again before the next order."""
        self._error = -1.0
        if self._fault:
            return Decision()
        try:
            decision = self._law.step(seen, now)
            check_decision(decision)
        except Exception as error:
            self._fault = f"the law failed: {type(error).__name__}: {error}"
            return Decision()
        if decision.estimate is not None and seen.motion is not None and seen.reference is not None:
            place = add(seen.reference.offset(seen.stamp), decision.estimate.position)
            self._error = norm(subtract(seen.motion.position, place))
        return decision

    def _forgive(self) -> None:
        """Begin the law anew after it failed: a new order came."""
        if self._fault:
            self._fault, self._law = "", self._make_law(self._swarm, self._number)

    def _said(self, decision: Decision, now: int) -> Estimate:
        assert decision.estimate is not None  # noqa: S101  (the caller looked)
        motion = decision.estimate
        return Estimate(decision.stamp or now, self._swarm.frame, motion.position, motion.velocity, motion.acceleration)

    def _decide(self, now: int, inputs: Inputs) -> None:
        limits, was = self._swarm.limits, self._flight.phase
        flying = self._telemetry is not None and self._telemetry.state in (FlightState.FLYING, FlightState.LANDING)
        height = self._pose.position[2] if self._pose is not None else 0.0
        phase = self._flight.update(
            Situation(
                now,
                self._fault or unready_reason(inputs, self._neighbourhood.missing(now), limits),
                self._fault or hold_reason(inputs, limits.staleness),
                land_reason(replace(inputs, pose=min(inputs.pose, age(self._born, now))), limits),
                flying,
                height >= 0.95 * limits.takeoff_height,
            )
        )
        if phase is not was:
            self._place = None

    def _velocity(self, seen: Observation, decision: Decision, inputs: Inputs, now: int) -> Vector:
        """Return the velocity to command for a fresh pose."""
        assert seen.motion is not None  # noqa: S101  (a fresh pose gives one)
        position, limits, phase = seen.motion.position, self._swarm.limits, self._flight.phase
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
        rise = self._swarm.limits.vertical_speed
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
        return (0.0, 0.0, -self._swarm.limits.vertical_speed) if landing else ZERO
