"""A baseline: to the place by optimal reciprocal collision avoidance, `[control] law = "law_orca:Orca"`.

J. van den Berg, S. J. Guy, M. Lin, D. Manocha, "Reciprocal n-body collision avoidance", Robotics Research (ISRR 2009),
Springer Tracts in Advanced Robotics 70, 2011, pp. 3-19. For each body the truncated velocity obstacle is

    VO = {v : exists t in (0, tau], |t v − p| < r}

with p its relative position and r the distance to be kept. u is the smallest change of the relative velocity that
leaves VO, n its outward normal. A drone takes half of u, because the other one takes the other half:

    n·v >= n·v_now + n·u / 2

The velocity is the nearest one to the wanted one in all these half-planes. The wanted one leads to the place in the
formation; the leader is the average of what the neighbours estimate.
"""

from __future__ import annotations

from math import hypot

from flockwire_core.control.safety_filter import HalfSpace, nearest_velocity
from flockwire_core.law import (
    RELAYING,
    SECOND,
    ZERO,
    Body,
    BodyKind,
    Decision,
    LawSettings,
    LeaderMotion,
    Observation,
    Parameters,
    Positive,
    Vector,
    add,
    limit,
    scale,
    subtract,
)

HORIZON = 2.0  # s, tau
SPARE = 0.02  # m, above the distance to be kept


class Gains(Parameters):
    """The gain of the wanted velocity, `[control] formation_gain` unless it is given."""

    formation_gain: Positive  # 1/s


class Orca:
    """The law for one follower."""

    information = RELAYING
    Parameters = Gains

    def __init__(self, settings: LawSettings) -> None:
        self._gain, self._speed = Gains.of(settings.parameters).formation_gain, settings.speed
        self._separation = settings.guard.separation
        self._leader: LeaderMotion | None = None

    def step(self, observation: Observation) -> Decision:
        """Return the velocity nearest to the wanted one that leaves all velocity obstacles."""
        self._observe(observation)
        motion, place = observation.motion, observation.place
        if self._leader is None or motion is None or place is None:
            return Decision(ZERO, self._leader)
        error = subtract(subtract(motion.position, place.offset(observation.t)), self._leader.position)
        forward = add(place.rate(observation.t), self._leader.velocity)
        wanted = add(forward, limit(scale(error, -self._gain), self._speed))
        planes = [
            half_plane(
                motion.velocity,
                body,
                body.relative_position[:2],
                self._separation.from_axis(body) + SPARE,
                0.5 if body.kind is BodyKind.DRONE else 1.0,
            )
            for body in observation.bodies
        ]
        return Decision(nearest_velocity(wanted, planes, self._speed)[0], self._leader)

    def _observe(self, observation: Observation) -> None:
        """Average the neighbours' estimates, each moved on to `now`; keep the last one without any."""
        estimates = observation.heard
        total = sum(one.weight for one in estimates)
        if not total:
            return
        moved = [(one.weight / total, one.content.after((observation.now - one.stamp) / SECOND)) for one in estimates]
        position = _weighted([(share, leader.position) for share, leader in moved])
        self._leader = LeaderMotion(position, _weighted([(share, leader.velocity) for share, leader in moved]))


def _weighted(vectors: list[tuple[float, Vector]]) -> Vector:
    total = ZERO
    for share, vector in vectors:
        total = add(total, scale(vector, share))
    return total


def half_plane(velocity: Vector, body: Body, place: tuple[float, float], radius: float, share: float) -> HalfSpace:
    """Return the half-plane of a body at `place` (m, relative): its share of the change that leaves the obstacle."""
    (x, y), (vx, vy) = place, velocity[:2]
    wx, wy = vx - body.velocity[0], vy - body.velocity[1]
    distance = max(hypot(x, y), 1e-6)
    cx, cy = wx - x / HORIZON, wy - y / HORIZON
    if distance <= radius:  # inside: away
        n, missing = (-x / distance, -y / distance), (radius - distance) / HORIZON + (wx * x + wy * y) / distance
    elif cx * x + cy * y < 0.0 and (cx * x + cy * y) ** 2 > radius**2 * (cx * cx + cy * cy):  # the round end
        length = hypot(cx, cy)
        n, missing = (cx / length, cy / length), radius / HORIZON - length
    else:
        side = 1.0 if x * wy - y * wx > -1e-3 * distance else -1.0  # head on: all to the same side
        leg = (distance * distance - radius * radius) ** 0.5
        ax, ay = (x * leg - side * y * radius) / distance**2, (y * leg + side * x * radius) / distance**2
        n = (-side * ay, side * ax)
        missing = -(n[0] * wx + n[1] * wy)
    nx, ny = n
    return (nx, ny, 0.0, nx * vx + ny * vy + share * missing)
