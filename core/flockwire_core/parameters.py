"""The frozen parameters of pilots, laws and their parts, from the swarm. Lengths are m, times s, the frame is ENU."""

from __future__ import annotations

from math import inf
from typing import NamedTuple

from flockwire_core.control.guard import GuardParameters
from flockwire_core.control.potential import PotentialParameters
from flockwire_core.law import LawSettings
from flockwire_core.objects import load_object
from flockwire_core.swarm.laws import law_object
from flockwire_core.swarm.model import Swarm
from flockwire_core.swarm.tables import Checks, Limits, Obstacle
from flockwire_core.wire.information import relays
from flockwire_core.wire.processes import Roster


class PilotParameters(NamedTuple):
    """The parameters of the pilot of drone `number`."""

    number: int
    frame: str  # the name of the world frame
    driver: str  # the processes that drive its airframe, for messages
    leaders: tuple[int, ...]  # likewise
    relays: bool  # whether the law relays estimates of the leader
    lag: float  # s, of its airframe
    dead_time: float  # s, likewise
    limits: Limits
    checks: Checks
    ground: float  # m, world z of the ground
    disturbance: float  # m/s, most that is compensated
    guard: GuardParameters  # also the room, the safety distances at landing, the highest speed, the period
    filtered: bool  # whether it has the safety filter
    sensing: bool  # whether it receives nearby bodies; else it knows its neighbours and `obstacles`
    obstacles: tuple[Obstacle, ...]
    potentials: PotentialParameters  # of the push while it holds without a safety filter
    formation_gain: float  # 1/s, of that push


def pilot_parameters(swarm: Swarm, number: int) -> PilotParameters:
    """Return the parameters of the pilot of drone `number` of `swarm`."""
    airframe, avoidance = swarm.airframe(number), swarm.avoidance
    return PilotParameters(
        number=number,
        frame=swarm.frame,
        driver=", ".join(Roster(swarm).drivers(number)),
        leaders=swarm.leaders,
        relays=relays(swarm),
        lag=airframe.lag,
        dead_time=airframe.dead_time,
        limits=swarm.limits,
        checks=swarm.checks,
        ground=swarm.ground,
        disturbance=swarm.control.compensated,
        guard=guard_parameters(swarm, number),
        filtered=swarm.control.filtered,
        sensing=avoidance.sensing == "nearby",
        obstacles=swarm.obstacles,
        potentials=potential_parameters(swarm),
        formation_gain=swarm.control.formation_gain,
    )


def guard_parameters(swarm: Swarm, number: int) -> GuardParameters:
    """Return the parameters of the safety filter of drone `number` of `swarm`, even if it has none."""
    airframe, avoidance, limits = swarm.airframe(number), swarm.avoidance, swarm.limits
    return GuardParameters(
        separation=avoidance.kept,
        room=limits.fence.room(),
        floor=limits.floor,
        speed=swarm.full_speed(number),
        vertical_speed=limits.vertical_speed,
        acceleration=limits.acceleration,
        barrier_rate=avoidance.barrier_rate,
        slowness=airframe.lag + airframe.dead_time,
        period=1.0 / swarm.control.rate_hz,
        sight=avoidance.sensing_radius if avoidance.sensing == "nearby" else inf,
        unheard=limits.staleness.command_zero,
    )


def law_parameters(swarm: Swarm, law: object) -> dict[str, object]:
    """Return [control.parameters] for the class `law`; what its model needs beyond them, other tables hold.

    `leader_places` (m, by number), which are the leaders' starts, any model may have.
    """
    control, observer = swarm.control, swarm.observer
    tables = {
        "formation_gain": control.formation_gain,
        "compensation_gain": control.compensation_gain,
        "compensation_smoothing": control.compensation_smoothing,
        "observer_step": observer.step,
        "observer_gain": observer.gain,
        "observer_exponent": observer.exponent,
        "velocity_time_constant": observer.velocity_time_constant,
        "leader_time_constant": observer.leader_time_constant or leader_time_constant(swarm.depth),
        **potential_parameters(swarm)._asdict(),
    }
    starts = {i: swarm.drone(i).start if one.has_body else one.start for i, one in swarm.leading.items()}
    fields = getattr(getattr(law, "Parameters", None), "model_fields", {})
    places = {"leader_places": starts} if "leader_places" in fields else {}
    needed = {name: tables[name] for name, field in fields.items() if field.is_required() and name in tables}
    return {**needed, **places, **control.parameters}


def leader_time_constant(depth: int) -> float:
    """Return the time constant T, s, of the tracker of the leader's velocity for a swarm of `depth` hops.

        T = max(0.15 s + 0.01 s · depth, 0.022 s · depth)        (ours)

    The deepest drone extrapolates the longest, so noise has most effect there; a slower tracker is later in turns.
    Beyond 12 hops T is a share of the age: the noise of the deepest estimate stays below twice that of the first.
    """
    return max(0.15 + 0.01 * depth, 0.022 * depth)


def law_settings(swarm: Swarm, number: int) -> LawSettings:
    """Return the settings of the law of follower `number` of `swarm`."""
    airframe, guard = swarm.airframe(number), guard_parameters(swarm, number)
    return LawSettings(
        number=number,
        period=guard.period,
        lag=airframe.lag,
        dead_time=airframe.dead_time,
        speed=guard.speed,
        acceleration=guard.acceleration,
        parameters=law_parameters(swarm, load_object(law_object(swarm))),
        guard=guard,
        neighbours=swarm.topology.neighbours(number),
    )


def potential_parameters(swarm: Swarm) -> PotentialParameters:
    """Return the gains and the radii of the potentials in (9)."""
    table = swarm.avoidance
    return PotentialParameters(
        table.drone_gain, table.drone_influence_radius, table.obstacle_gain, table.obstacle_influence_radius
    )
