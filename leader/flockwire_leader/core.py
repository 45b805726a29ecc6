"""The leader without clock, input or output: it flies uav0 along its scripted trajectory, or is a virtual point."""

from __future__ import annotations

from flockwire.control.graph import LEADER
from flockwire.control.vector import ZERO, Vector, add, limit, scale, subtract
from flockwire.flight.cores import Start
from flockwire.flight.phases import (
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
from flockwire.swarm.model import Swarm, uav
from flockwire.wire.keys import Key
from flockwire.wire.messages import Command, FlightState, Message, Mission, Pose, Stop, Telemetry
from flockwire.wire.status import Report


class FlyingLeader:
    """Flies drone 0 along the trajectory; begun at `now` (Unix ns)."""

    def __init__(self, swarm: Swarm, now: int) -> None:
        self.triggers = frozenset({Key("pose", uav(LEADER))})
        self.prompt: frozenset[Key] = frozenset()
        self.period = 1.0 / swarm.control.rate_hz
        self._swarm = swarm
        self._command_key = Key("command", uav(LEADER))
        self._trajectory = swarm.leader.trajectory.build()
        self._flight = Flight(now)
        self._pose: Pose | None = None
        self._telemetry: Telemetry | None = None
        self._born = now
        self._place: Vector | None = None  # where it holds, or took off; None until it knows where it is
        self._begin = ZERO  # where the trajectory begins

    def receive(self, key: Key, message: Message, now: int) -> None:
        """Take in a message."""
        match message:
            case Pose():
                self._pose = message
            case Telemetry():
                self._telemetry = message
            case Mission():
                self._flight.order(message)
            case Stop():
                self._flight.stop()

    def due(self, key: Key) -> bool:
        """Return True: each own pose calls for a step."""
        return True

    def step(self, now: int) -> list[tuple[Key, Message]]:
        """Decide and command: what to publish at `now`."""
        pose_age = age(self._pose.stamp, now) if self._pose is not None else NEVER
        self._decide(now, pose_age)
        stamp, fresh = command_stamp(self._pose, now, self._swarm.limits.staleness.pose_zero)
        velocity = self._velocity(stamp) if fresh else self._blind_velocity()
        return [(self._command_key, Command(stamp, self._swarm.frame, velocity))]

    def report(self, now: int) -> Report:
        """Return how the leader is."""
        pose, telemetry = self._pose, self._telemetry
        return Report(
            self._flight.phase,
            self._flight.reason,
            pose_age=age(pose.stamp, now) if pose is not None else -1.0,
            telemetry_age=age(telemetry.stamp, now) if telemetry is not None else -1.0,
            battery=telemetry.battery if telemetry is not None else -1.0,
        )

    def _decide(self, now: int, pose_age: float) -> None:
        limits, telemetry, was = self._swarm.limits, self._telemetry, self._flight.phase
        stale, fence = limits.staleness, limits.fence
        telemetry_age = age(telemetry.stamp if telemetry is not None else 0, now)
        battery = telemetry.battery if telemetry is not None else 1.0
        position = self._pose.position if self._pose is not None else ZERO
        beyond = outside(position, fence.min, fence.max)
        unready = (
            "waits for its own pose" if pose_age > stale.pose_zero
            else "waits for its driver's telemetry" if telemetry_age > stale.telemetry_warn
            else f"battery at {battery:.0%}" if battery < limits.battery_takeoff
            else ""
        )  # fmt: skip
        blind = min(pose_age, age(self._born, now))
        land = (
            f"own pose lost for {blind:.1f} s" if blind > stale.pose_land
            else f"telemetry lost for {telemetry_age:.1f} s" if telemetry_age > stale.telemetry_land
            else f"battery at {battery:.0%}" if battery < limits.battery_land
            else f"{beyond:.1f} m outside the fence" if beyond > fence.margin
            else ""
        )  # fmt: skip
        flying = telemetry is not None and telemetry.state in (FlightState.FLYING, FlightState.LANDING)
        hold = "own pose is stale" if pose_age > stale.pose_zero else ""
        high = position[2] >= 0.95 * limits.takeoff_height
        phase = self._flight.update(Situation(now, unready, hold, land, flying, high))
        if phase is not was:
            self._place = None
        if phase is Phase.FORMATION and was is not Phase.FORMATION:
            self._begin = subtract(position, self._trajectory.position(self._flight.mission_time(now) or 0.0))

    def _velocity(self, stamp: int) -> Vector:
        assert self._pose is not None  # noqa: S101  (a fresh pose is one)
        position, limits, phase = self._pose.position, self._swarm.limits, self._flight.phase
        self._place = self._place or position
        if phase is Phase.LANDING:
            return climb(position, self._place, -limits.vertical_speed)
        if phase is Phase.TAKEOFF:
            return climb(position, self._place, limits.vertical_speed)
        if phase is Phase.HOLD:
            wanted = keep_place(position, self._place, limits.vertical_speed)
        elif phase is Phase.FORMATION:
            t = self._flight.mission_time(stamp) or 0.0
            goal = add(self._begin, self._trajectory.position(t))
            correction = scale(subtract(goal, position), self._swarm.leader.tracking_gain)
            wanted = add(self._trajectory.rate(t), correction)
        else:
            return ZERO
        return limit(fenced(wanted, position, limits.fence.min, limits.fence.max), limits.speed)

    def _blind_velocity(self) -> Vector:
        landing = self._flight.phase is Phase.LANDING
        return (0.0, 0.0, -self._swarm.limits.vertical_speed) if landing else ZERO


class VirtualLeader:
    """A point that moves along the trajectory while the order is to start, and rests otherwise."""

    def __init__(self, swarm: Swarm, now: int) -> None:
        self.triggers: frozenset[Key] = frozenset()
        self.prompt: frozenset[Key] = frozenset()
        self.period = 1.0 / swarm.control.rate_hz
        self._swarm = swarm
        self._trajectory = swarm.leader.trajectory.build()
        self._flight = Flight(now)
        self._position: Vector = swarm.leader.start
        self._begin: Vector = swarm.leader.start  # where the trajectory begins

    def receive(self, key: Key, message: Message, now: int) -> None:
        """Take in a message."""
        if isinstance(message, Mission):
            self._flight.order(message)
            t = self._flight.mission_time(now)
            if t is not None and self._flight.mission is message:
                self._begin = subtract(self._position, self._trajectory.position(t))

    def due(self, key: Key) -> bool:
        """Return False: a point moves at its own rate."""
        return False

    def step(self, now: int) -> list[tuple[Key, Message]]:
        """Say where the point is at `now`."""
        t = self._flight.mission_time(now)
        if t is not None:
            self._position = add(self._begin, self._trajectory.position(t))
        return [(Key("pose", uav(LEADER)), Pose(now, self._swarm.frame, self._position))]

    def report(self, now: int) -> Report:
        """Return how the leader is."""
        moving = (self._flight.mission_time(now) or 0.0) > 0.0
        return Report(Phase.FORMATION if moving else Phase.READY)


def make_core(start: Start) -> FlyingLeader | VirtualLeader:
    """Return the core of the leader that the swarm has."""
    swarm = start.plan.swarm
    return VirtualLeader(swarm, start.now) if swarm.leader.kind == "virtual" else FlyingLeader(swarm, start.now)
