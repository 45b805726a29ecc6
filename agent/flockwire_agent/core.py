"""A follower's agent without clock, input or output: it observes the leader, flies the formation, keeps clear."""

from __future__ import annotations

from dataclasses import replace

from flockwire.config import Swarm
from flockwire.control.observer import ObserverParameters, explicit_step, implicit_step, rate_estimate
from flockwire.control.protocol import ProtocolParameters, control_input
from flockwire.control.vector import ZERO, Vector, add, limit, norm, scale, subtract
from flockwire.flight import (
    BILLION,
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
from flockwire.messages import Command, Estimate, FlightState, Message, Mission, Nearby, Pose, Report, Stop, Telemetry

from flockwire_agent.avoidance import known_bodies, repulsion
from flockwire_agent.ladder import Inputs, hold_reason, land_reason, shown, speed_limit, unready_reason
from flockwire_agent.neighbourhood import Neighbourhood

LONGEST_STEP = 0.1  # s: after a longer pause the observer goes on as if only this had passed


class AgentCore:
    """Follower `number` of `swarm`, begun at `now` (Unix ns)."""

    def __init__(self, swarm: Swarm, number: int, now: int) -> None:
        self.trigger = Key("pose", uav(number))
        self.prompt: frozenset[Key] = frozenset()
        self.period = 1.0 / swarm.control.rate_hz
        self._swarm, self._born = swarm, now
        self._estimate_key, self._command_key = Key("estimate", uav(number)), Key("command", uav(number))
        self._others = {uav(j): j for j in (0, *swarm.followers)}
        self._index = swarm.followers.index(number)
        self._observe = implicit_step if swarm.observer.step == "implicit" else explicit_step
        self._observer = ObserverParameters(swarm.observer.gain, swarm.observer.exponent)
        self._protocol = ProtocolParameters(
            swarm.control.formation_gain, swarm.control.compensation_gain, swarm.control.compensation_smoothing
        )
        self._formations = {name: swarm.build_formation(name) for name in ("", *swarm.formations)}
        self._neighbourhood = Neighbourhood(swarm.topology.neighbours(number), swarm.limits.staleness.estimate_drop)
        self._flight = Flight(now)
        self._pose: Pose | None = None
        self._nearby: Nearby | None = None
        self._telemetry: Telemetry | None = None
        self._leader: Vector | None = None  # eta_i
        self._leader_velocity = ZERO
        self._observed = 0  # the stamp of the newest estimate
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
                self._nearby = message
            case Telemetry():
                self._telemetry = message
            case Mission() if message.formation in self._formations:
                self._flight.order(message)
            case Stop():
                self._flight.stop()

    def step(self, now: int) -> list[tuple[Key, Message]]:
        """Observe, decide, command: what to publish at `now`."""
        dt = min((now - self._stepped) / BILLION, LONGEST_STEP)
        self._stepped = now
        self._advance_observer(now, dt)
        inputs = self._inputs(now)
        self._error = -1.0
        stamp, fresh = command_stamp(self._pose, now, self._swarm.limits.staleness.pose_zero)
        self._decide(now, inputs)
        velocity = self._velocity(stamp, inputs) if fresh else self._blind_velocity()
        messages: list[tuple[Key, Message]] = [(self._command_key, Command(stamp, self._swarm.frame, velocity))]
        if self._leader is not None:
            self._observed = max(self._observed, stamp if fresh else now)
            estimate = Estimate(self._observed, self._swarm.frame, self._leader, self._leader_velocity)
            messages.append((self._estimate_key, estimate))
        return messages

    def report(self, now: int) -> Report:
        """Return how the agent is."""
        inputs = self._inputs(now)
        nearby = age(self._nearby.stamp, now) if self._nearby is not None else -1.0
        return Report(
            self._flight.phase, self._flight.reason, self._error, shown(inputs.pose),
            shown(self._neighbourhood.oldest(now)), nearby, shown(inputs.telemetry),
            self._telemetry.battery if self._telemetry is not None else -1.0,
        )  # fmt: skip

    def _inputs(self, now: int) -> Inputs:
        pose, nearby, telemetry = self._pose, self._nearby, self._telemetry
        sensing = self._swarm.avoidance.sensing == "nearby"
        fence = self._swarm.limits.fence
        return Inputs(
            age(pose.stamp if pose is not None else 0, now),
            self._neighbourhood.silence(now, self._born),
            age(nearby.stamp if nearby is not None else 0, now) if sensing else 0.0,
            age(telemetry.stamp if telemetry is not None else 0, now),
            telemetry.battery if telemetry is not None else 1.0,
            outside(pose.position, fence.min, fence.max) if pose is not None else 0.0,
        )

    def _advance_observer(self, now: int, dt: float) -> None:
        """One step of (8); the first guess is the own position, for want of a better one."""
        if self._leader is None:
            if self._pose is None:
                return
            self._leader = self._pose.position
        previous = self._leader
        self._leader = self._observe(previous, self._neighbourhood.estimates(now), self._observer, dt)
        if dt > 0.0:
            time_constant = self._swarm.observer.velocity_time_constant
            self._leader_velocity = rate_estimate(self._leader_velocity, previous, self._leader, dt, time_constant)

    def _decide(self, now: int, inputs: Inputs) -> None:
        limits, was = self._swarm.limits, self._flight.phase
        flying = self._telemetry is not None and self._telemetry.state in (FlightState.FLYING, FlightState.LANDING)
        height = self._pose.position[2] if self._pose is not None else 0.0
        phase = self._flight.update(
            Situation(
                now,
                unready_reason(inputs, self._neighbourhood.missing(now), limits),
                hold_reason(inputs, limits.staleness),
                land_reason(replace(inputs, pose=min(inputs.pose, age(self._born, now))), limits),
                flying,
                height >= 0.95 * limits.takeoff_height,
            )
        )
        if phase is not was:
            self._place = None

    def _velocity(self, stamp: int, inputs: Inputs) -> Vector:
        """Return the velocity to command for the pose stamped `stamp`."""
        assert self._pose is not None  # noqa: S101  (a fresh pose is one)
        position, limits, phase = self._pose.position, self._swarm.limits, self._flight.phase
        self._place = self._place or position
        if phase is Phase.LANDING:
            return climb(position, self._place, -limits.vertical_speed)
        if phase is Phase.TAKEOFF:
            return climb(position, self._place, limits.vertical_speed)
        if phase is Phase.FORMATION:
            wanted = self._track(position, stamp)
        elif phase is Phase.HOLD:
            push = scale(self._repulsion(position), -self._protocol.formation_gain)
            wanted = add(keep_place(position, self._place, limits.vertical_speed), push)
        else:
            return ZERO
        wanted = fenced(wanted, position, limits.fence.min, limits.fence.max)
        return limit(wanted, speed_limit(inputs, limits))

    def _track(self, position: Vector, stamp: int) -> Vector:
        """Return u_i of (9) at the time of the pose."""
        mission, t = self._flight.mission, self._flight.mission_time(stamp)
        assert mission is not None and t is not None and self._leader is not None  # noqa: S101  (in formation they are)
        formation = self._formations[mission.formation]
        offset, rate = formation.offset(self._index, t), formation.offset_rate(self._index, t)
        self._error = norm(subtract(subtract(position, offset), self._leader))
        return control_input(position, offset, rate, self._leader, self._repulsion(position), self._protocol)

    def _repulsion(self, position: Vector) -> Vector:
        if self._swarm.avoidance.sensing == "nearby":
            bodies = list(self._nearby.bodies) if self._nearby is not None else []
        else:
            bodies = known_bodies(position, self._neighbourhood.positions(), self._swarm.obstacles)
        return repulsion(bodies, self._swarm.avoidance)

    def _blind_velocity(self) -> Vector:
        """Return the velocity to command without a fresh pose: straight down when landing, else none."""
        landing = self._flight.phase is Phase.LANDING
        return (0.0, 0.0, -self._swarm.limits.vertical_speed) if landing else ZERO
