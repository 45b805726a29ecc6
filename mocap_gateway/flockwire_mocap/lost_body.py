"""Where a body may be that the tracker has lost: an upright cylinder round its last place, which grows with its age."""

from __future__ import annotations

from typing import NamedTuple

from flockwire.domain.body import Body, BodyKind, to_axis
from flockwire.domain.vector import ZERO, Vector, norm, scale
from flockwire.swarm.model import Swarm

DRIFT = 0.1  # m/s by which an airframe that hovers or lands by sensors of its own may leave its place
STANDS = 0.1  # m above the ground below which a drone stands there
WALK = 0.5  # m/s at least of a person who is not seen
WAY = 1.0  # m that a person is taken to walk unseen; more would clear half the field for a hidden marker


class Spread(NamedTuple):
    """How far a body may have come since it was seen: m/s for some s, then at another speed for some s more."""

    speed: float = 0.0
    coasting: float = 0.0
    drift: float = 0.0
    drifting: float = 0.0

    def reach(self, age: float) -> float:
        """Return how far, m, it may be from where it was seen `age` s ago."""
        drifted = min(max(age - self.coasting, 0.0), self.drifting)
        return self.speed * min(age, self.coasting) + self.drift * drifted

    def growth(self, age: float) -> float:
        """Return how fast, m/s, that becomes more."""
        if age < self.coasting:
            return self.speed
        return self.drift if age - self.coasting < self.drifting else 0.0


STILL = Spread()


def drone_spread(swarm: Swarm, drone: int, height: float) -> Spread:
    """Return how far a drone may come without poses that was seen `height` m above the ground.

        r(t) = v_max min(t, t_1) + v_drift min(max(t − t_1, 0), t_2 − t_1)
        t_1 = pose_zero + D + lag,   t_2 = pose_land + D + lag + height / v_z        (ours)

    Its pilot stops it after pose_zero and lands it straight down after pose_land; once it is down it goes nowhere.
    """
    if height <= STANDS:
        return STILL
    limits, frame = swarm.limits, swarm.airframe(drone)
    stale, slowness = limits.staleness, frame.dead_time + frame.lag
    coasting = stale.pose_zero + slowness
    down = stale.pose_land + slowness + height / limits.vertical_speed
    return Spread(limits.speed, coasting, DRIFT, max(down - coasting, 0.0))


def person_spread(speed: float) -> Spread:
    """Return how far a person may come who was seen walking at `speed`, m/s: on, back, or aside, WAY at most."""
    speed = max(speed, WALK)
    return Spread(speed, WAY / speed)


class LostBody(NamedTuple):
    """The cylinder at the present moment: from the ground to `height` m (endless without), `growth` in m/s.

    It is an obstacle: nobody gives way in it. A mover it is not: the distance to that is one to a body, and is judged.
    """

    position: Vector
    height: float | None
    radius: float
    growth: float

    def near(self, position: Vector, reach: float) -> Body | None:
        """Return it as seen from `position` (m), None where its surface is `reach` m away or more.

        Wherever it is seen from outside, its surface comes nearer at the speed at which it grows.
        """
        relative = to_axis(position, self.position, self.height)
        distance = norm(relative)
        if distance - self.radius >= reach:
            return None
        coming = scale(relative, -self.growth / distance) if distance > self.radius else ZERO
        return Body(BodyKind.OBSTACLE, relative, self.radius, coming)
