"""From the swarm to the frozen parameters of what flies one drone: the only place that makes them."""

from __future__ import annotations

from math import inf
from typing import NamedTuple

from flockwire.control.fence import Room
from flockwire.control.guard import GuardParameters
from flockwire.control.leader_track import leader_time_constant
from flockwire.control.observer import ObserverParameters
from flockwire.control.potential import PotentialParameters
from flockwire.control.protocol import ProtocolParameters
from flockwire.control.sidestep import SidestepParameters
from flockwire.domain.body import Separation
from flockwire.law import LawSettings
from flockwire.swarm.model import Swarm
from flockwire.swarm.tables import Checks, Limits, Obstacle
from flockwire.wire.processes import Roster


class PilotParameters(NamedTuple):
    """What the pilot of drone `number` flies by."""

    number: int
    frame: str  # the name of the world frame
    driver: str  # the processes that drive its airframe, for people
    lag: float  # s, of its airframe
    dead_time: float  # s, likewise
    limits: Limits
    checks: Checks
    room: Room
    separation: Separation  # m, to keep where it comes down
    guard: GuardParameters | None  # None if no safety filter is round the commands
    sensing: bool  # whether it is served what is near; else it knows its neighbours and `obstacles`
    obstacles: tuple[Obstacle, ...]
    potentials: PotentialParameters  # which push it while it holds without a safety filter
    formation_gain: float  # 1/s, of that push


def pilot_parameters(swarm: Swarm, number: int) -> PilotParameters:
    """Return what the pilot of drone `number` of `swarm` flies by."""
    airframe, avoidance = swarm.airframe(number), swarm.avoidance
    return PilotParameters(
        number=number,
        frame=swarm.frame,
        driver=", ".join(Roster(swarm).drivers(number)),
        lag=airframe.lag,
        dead_time=airframe.dead_time,
        limits=swarm.limits,
        checks=swarm.checks,
        room=swarm.limits.fence.room(),
        separation=avoidance.kept,
        guard=guard_parameters(swarm, number) if swarm.control.filtered else None,
        sensing=avoidance.sensing == "nearby",
        obstacles=swarm.obstacles,
        potentials=potential_parameters(swarm),
        formation_gain=swarm.control.formation_gain,
    )


def guard_parameters(swarm: Swarm, number: int) -> GuardParameters:
    """Return what the safety filter of drone `number` of `swarm` keeps to, whether it has one or not."""
    airframe, avoidance, limits = swarm.airframe(number), swarm.avoidance, swarm.limits
    return GuardParameters(
        separation=avoidance.kept,
        room=limits.fence.room(),
        floor=limits.floor,
        speed=limits.speed,
        vertical_speed=limits.vertical_speed,
        acceleration=limits.acceleration,
        barrier_rate=avoidance.barrier_rate,
        slowness=airframe.lag + airframe.dead_time,
        period=1.0 / swarm.control.rate_hz,
        sight=avoidance.sensing_radius if avoidance.sensing == "nearby" else inf,
    )


def law_settings(swarm: Swarm, number: int) -> LawSettings:
    """Return what the law of follower `number` of `swarm` is made from."""
    airframe, control, observer = swarm.airframe(number), swarm.control, swarm.observer
    return LawSettings(
        number=number,
        period=1.0 / control.rate_hz,
        lag=airframe.lag,
        dead_time=airframe.dead_time,
        speed=swarm.limits.speed,
        acceleration=swarm.limits.acceleration,
        parameters=control.parameters,
        protocol=ProtocolParameters(control.formation_gain, control.compensation_gain, control.compensation_smoothing),
        observer=ObserverParameters(observer.gain, observer.exponent),
        explicit_observer=observer.step == "explicit",
        velocity_time_constant=observer.velocity_time_constant,
        leader_time_constant=observer.leader_time_constant or leader_time_constant(swarm.depth),
        potentials=potential_parameters(swarm),
        sidestep=sidestep_parameters(swarm),
    )


def potential_parameters(swarm: Swarm) -> PotentialParameters:
    """Return the gains and the radii of the potentials in (9)."""
    table = swarm.avoidance
    return PotentialParameters(
        table.drone_gain, table.drone_influence_radius, table.obstacle_gain, table.obstacle_influence_radius
    )


def sidestep_parameters(swarm: Swarm) -> SidestepParameters:
    """Return what counts as in a drone's way."""
    return SidestepParameters(swarm.avoidance.safe, swarm.avoidance.sidestep_reach)
