"""The space where a lost body may be: an upright cylinder around its last place, which grows with its age."""

from __future__ import annotations

from typing import NamedTuple

from flockwire_core.domain.body import Body, BodyKind, to_axis
from flockwire_core.domain.vector import ZERO, Vector, norm, scale
from flockwire_core.swarm.model import Swarm

DRIFT = 0.1  # m/s of drift of an airframe that hovers or lands by its own sensors
WAY = 1.0  # m, largest assumed way of an unseen person; more would block half the field for a hidden marker


class Spread(NamedTuple):
    """The distance that a body may have moved since it was seen: at one speed (m/s) for some s, then at another."""

    speed: float = 0.0
    coasting: float = 0.0
    drift: float = 0.0
    drifting: float = 0.0

    def reach(self, age: float) -> float:
        """Return its largest distance, m, from the place where it was seen `age` s ago."""
        drifted = min(max(age - self.coasting, 0.0), self.drifting)
        return self.speed * min(age, self.coasting) + self.drift * drifted

    def growth(self, age: float) -> float:
        """Return the growth of this distance, m/s."""
        if age < self.coasting:
            return self.speed
        return self.drift if age - self.coasting < self.drifting else 0.0


STILL = Spread()


def drone_spread(swarm: Swarm, drone: int, height: float) -> Spread:
    """Return the spread of a drone without poses that was seen `height` m above the ground.

        r(t) = v_max min(t, t_1) + v_drift min(max(t − t_1, 0), t_2 − t_1)
        t_1 = pose_zero + D + lag,   t_2 = pose_land + D + lag + height / v_z        (ours)

    Its pilot stops it after pose_zero and lands it straight down after pose_land; on the ground it does not move.
    """
    if height <= 0.1:  # m above the ground; a drone below it is on the ground
        return STILL
    limits, frame = swarm.limits, swarm.airframe(drone)
    stale, slowness = limits.staleness, frame.dead_time + frame.lag
    coasting = stale.pose_zero + slowness
    down = stale.pose_land + slowness + height / limits.vertical_speed
    return Spread(limits.speed, coasting, DRIFT, max(down - coasting, 0.0))


def person_spread(speed: float) -> Spread:
    """Return the spread of a person who was seen walking at `speed`, m/s: in any direction, WAY at most."""
    speed = max(speed, 0.5)  # m/s, least speed of a person who is not seen
    return Spread(speed, WAY / speed)


class LostBody(NamedTuple):
    """The cylinder at the present moment: from the ground to `height` m (endless without), `growth` in m/s.

    It is an obstacle, because the body does not give way. It is not a mover: checks judge the distance to a mover.
    """

    position: Vector
    height: float | None
    radius: float
    growth: float

    def near(self, position: Vector, reach: float) -> Body | None:
        """Return it as seen from `position` (m), None if its surface is `reach` m away or more.

        From any place outside, its surface approaches at its rate of growth.
        """
        relative = to_axis(position, self.position, self.height)
        distance = norm(relative)
        if distance - self.radius >= reach:
            return None
        coming = scale(relative, -self.growth / distance) if distance > self.radius else ZERO
        return Body(BodyKind.OBSTACLE, relative, self.radius, coming)
