"""Two other ways round what is in the way, to compare: around.py `--law around_laws:Reciprocal`, or `:Planned`.

Both are the extended law with another choice of the velocity to the place; the safety filter is the same.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import cos, hypot, pi, sin

from flockwire_agent.extended_law import ExtendedLaw
from flockwire_core.control.safety_filter import nearest_velocity
from flockwire_core.domain.body import Body, BodyKind
from flockwire_core.domain.motion import Motion
from flockwire_core.domain.vector import Vector, add, limit, scale
from flockwire_core.law import LawSettings, Observation
from law_orca import half_plane

STEP, STEPS = 0.25, 12  # s, of a plan
REPLAN = 5  # steps of control
HEADINGS = 12


class _Way(ExtendedLaw):
    """The extended law without its own ways round bodies."""

    def __init__(self, settings: LawSettings) -> None:
        super().__init__(settings)
        self._own = settings.detour

    def _around(self, observation: Observation, motion: Motion, forward: Vector, error: Vector, now: float) -> Vector:
        correction, bodies = limit(scale(error, -self._gain), self._speed), observation.bodies
        return self.around(motion, forward, error, correction, bodies) if bodies else add(forward, correction)

    def around(
        self, motion: Motion, forward: Vector, error: Vector, correction: Vector, bodies: Sequence[Body]
    ) -> Vector:
        """Return the velocity, m/s, with bodies nearby."""
        raise NotImplementedError

    def discs(self, motion: Motion, bodies: Sequence[Body]) -> Iterator[tuple[Body, float, float, float]]:
        """Yield each body with its place relative to the stopping point and the distance to keep, m."""
        sx, sy = motion.stopping[0] - motion.position[0], motion.stopping[1] - motion.position[1]
        for body in bodies:
            x, y, _ = body.relative_position
            yield body, x - sx, y - sy, self._own.separation.from_axis(body) + 0.02


class Reciprocal(_Way):
    """Optimal reciprocal collision avoidance: the nearest velocity outside every truncated velocity obstacle."""

    def around(
        self, motion: Motion, forward: Vector, error: Vector, correction: Vector, bodies: Sequence[Body]
    ) -> Vector:
        """Return the velocity, m/s."""
        planes = [
            half_plane(motion.velocity, body, (x, y), r, 0.5 if body.kind is BodyKind.DRONE else 1.0)
            for body, x, y, r in self.discs(motion, bodies)
        ]
        return nearest_velocity(add(forward, correction), planes, self._own.speed)[0]


class Planned(_Way):
    """The best of a few plans: one heading for some time, then straight to the place; others keep their velocities."""

    def __init__(self, settings: LawSettings) -> None:
        super().__init__(settings)
        self._left, self._kept = 0, (0.0, 0.0)

    def around(
        self, motion: Motion, forward: Vector, error: Vector, correction: Vector, bodies: Sequence[Body]
    ) -> Vector:
        """Return the velocity, m/s."""
        self._left -= 1
        if self._left < 0:
            self._left = REPLAN - 1
            others = [
                (x, y, r, body.velocity[0] - forward[0], body.velocity[1] - forward[1])
                for body, x, y, r in self.discs(motion, bodies)
            ]
            self._kept = self._best((error[0], error[1]), others)
        return add(forward, (*self._kept, correction[2])) if self._kept != (0.0, 0.0) else add(forward, correction)

    def _best(
        self, error: tuple[float, float], others: list[tuple[float, float, float, float, float]]
    ) -> tuple[float, float]:
        """Return the first velocity of the best plan relative to the place; zero: straight."""
        speed = 0.7 * self._own.speed
        plans = [((0.0, 0.0), 0)]
        for k in range(HEADINGS):
            angle = 2.0 * pi * k / HEADINGS
            plans += [((speed * cos(angle), speed * sin(angle)), steps) for steps in (2, 5)]

        def cost(plan: tuple[tuple[float, float], int]) -> float:
            (vx, vy), first = plan
            x, y, total = 0.0, 0.0, 0.02 * hypot(vx - self._kept[0], vy - self._kept[1])
            for k in range(1, STEPS + 1):
                if k <= first:
                    x, y = x + STEP * vx, y + STEP * vy
                else:
                    gx, gy = -error[0] - x, -error[1] - y
                    gap = hypot(gx, gy)
                    share = min(1.0, STEP * speed / gap) if gap > 0.0 else 0.0
                    x, y = x + share * gx, y + share * gy
                total += hypot(error[0] + x, error[1] + y) / STEPS
                t = k * STEP
                for ox, oy, r, ux, uy in others:
                    dx, dy = ox + t * ux - x, oy + t * uy - y
                    if dx * dx + dy * dy < r * r:
                        total += 3.0 * (r - hypot(dx, dy)) / r
            return total

        return min(plans, key=cost)[0]
