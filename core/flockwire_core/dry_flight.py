"""What a law observes in a few steps without a flight: on the ground, in formation, without a pose."""

from __future__ import annotations

from collections.abc import Iterator

from flockwire_core.domain.body import Body, BodyKind
from flockwire_core.domain.motion import LeaderMotion, Motion
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import ZERO, Vector, add
from flockwire_core.law import STATE, Heard, Information, Observation, Place, Sense
from flockwire_core.swarm.model import Swarm
from flockwire_core.wire.information import information_of, relays
from flockwire_core.wire.sighting import sensed

START = 1_790_000_000 * SECOND  # Unix ns of a dry flight
OFF_PLACE: Vector = (0.1, -0.2, 0.05)  # m, of a drone from its place in a dry step
IN_FORMATION = "flies in formation"
BESIDE: Vector = (0.6, 0.8, 0.0)  # m, from a drone to a nearby body in a dry step


def dry_flight(swarm: Swarm, number: int, said: list[object]) -> Iterator[tuple[str, Observation]]:
    """Yield what the law of follower `number` observes in a few steps, each with its situation, to follow `when it`.

    It observes what it declares; its neighbours send what it has `said` itself, or their estimates.
    """
    declared, relayed, leader = information_of(swarm), relays(swarm), _place_of_leader(swarm)
    period, estimates = 1.0 / swarm.control.rate_hz, swarm.topology.neighbours(number)
    rank = swarm.followers.index(number)
    ranks = {j: swarm.followers.index(j) for j in estimates if j in swarm.followers}
    formation = Place(swarm.build_formation(), rank, START, ranks)
    start, flown = swarm.drone(number).start, add(add(leader, formation.offset(0.0)), OFF_PLACE)
    for step, (when, position, place) in enumerate(
        (
            ("has no pose yet", None, None),
            ("stands on the ground", start, None),
            *[(IN_FORMATION, flown, formation)] * 4,
            ("flies on without a pose", None, formation),
        )
    ):
        now = START + round(step * period * SECOND)
        observation = Observation(dt=period, stamp=now, place=place, now=now)
        if place is not None:
            bodies = _bodies_beside(swarm) if declared.around else ()
            observation = observation._replace(t=(now - START) / SECOND, bodies=bodies)
        if position is not None:
            observation = observation._replace(**_sensed(swarm, number, declared, position))
            content = LeaderMotion(leader) if relayed else said[-1] if said else None
            heard = [Heard(j, weight, j in swarm.leaders, now, step, content) for j, weight in estimates.items()]
            heard = heard if content is not None else []
            observation = observation._replace(heard=heard, news=() if relayed else heard)
        yield when, observation


def _place_of_leader(swarm: Swarm) -> Vector:
    sole = swarm.sole_leader
    start = swarm.drone(sole).start if sole is not None and sole in swarm.flying else ZERO
    return add(start, (0.0, 0.0, swarm.limits.takeoff_height))


def _bodies_beside(swarm: Swarm) -> tuple[Body, ...]:
    kinds = (BodyKind.DRONE, BodyKind.OBSTACLE) if swarm.obstacles else (BodyKind.DRONE,)
    return tuple([Body(kind, BESIDE, 0.0) for kind in kinds])


def _sensed(swarm: Swarm, number: int, declared: Information, position: Vector) -> dict[str, object]:
    """Return the fields of what a law that declares `declared` senses at `position`: itself, and drones beside it."""
    leaders, weights = swarm.leaders, swarm.topology.neighbours(number)
    own, motion = declared.own, Motion(position, ZERO, position)
    found: dict[str, object] = {
        "position": position if own & Sense.POSITION else None,
        "velocity": ZERO if own & Sense.VELOCITY else None,
        "motion": motion if own & STATE == STATE else None,
    }
    if declared.neighbours:
        senses = declared.neighbours
        seen = [sensed(senses, j, BESIDE, ZERO, weight=weight, leads=j in leaders) for j, weight in weights.items()]
        found["neighbours"] = seen
    if declared.around and declared.radius:
        found["around"] = [sensed(declared.around, number + 1 if declared.named else -1, BESIDE, ZERO)]
    return found
