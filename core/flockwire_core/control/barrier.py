"""The barrier: the allowed approach speed to bodies and walls, as half-spaces for the safety filter."""

from __future__ import annotations

from math import inf, sqrt
from typing import Final

from flockwire_core.control.safety_filter import HalfSpace
from flockwire_core.domain.vector import Vector, norm, scale

_COINCIDENT: Final = 1e-9
_SHIFTED: Final = 0.2  # of A, more than half, for a drone that moves; more pushes one at its place (docs/theory.md)


class Approach:
    """How fast a drone may approach what it must not reach: it needs the way R(s), m, to brake from the speed s.

        R(s) = s / alpha                      for s <= b / alpha
        R(s) = s^2 / (2 b) + b / (2 alpha^2)  beyond          (ours)

    Both branches meet with the same slope. Sampled every dt, R(s) <= gap keeps the gap above 0 while alpha dt <= 1.
    """

    def __init__(self, last: Vector, speed: float, rate: float, braking: float) -> None:
        self.last: Final = last  # m/s, the last command
        self.pace: Final = norm(last)  # m/s
        self.speed: Final = max(speed, self.pace)  # m/s, the largest of the next
        self.rate: Final = rate  # 1/s, alpha
        self.braking: Final = braking  # m/s^2, the deceleration b

    def way(self, speed: float) -> float:
        """Return R(s), m, of the `speed` s, m/s; negative for a drone that leaves."""
        if speed * self.rate <= self.braking:
            return speed / self.rate
        return speed * speed / (2.0 * self.braking) + self.braking / (2.0 * self.rate * self.rate)

    def growth(self, speed: float) -> float:
        """Return dR/ds, s, at the `speed` s, m/s."""
        return max(1.0 / self.rate, speed / self.braking)

    def half_space(self, normal: Vector, gap: float, closing: float = 0.0, recovery: float = inf) -> HalfSpace | None:
        """Return the half-space of velocities u that leave a `gap` (m) to a plane, None if every velocity does.

            p/s R(s) + R(p + c) − R(p) <= gap,   s = |u|,   p = −n·u        made linear at the last command      (ours)

        `normal` n leads away from the plane, which comes along n at `closing` c, m/s. The first term is the way along
        −n of a drone that brakes straight. So it comes nearer by as much as it needs less, to each of several planes:
        where all are satisfied, they stay so. From beyond a plane it comes back at alpha times the way, `recovery`
        (m/s) at most.
        """
        x, y, z = normal
        vx, vy, vz = self.last
        own, speed = -(x * vx + y * vy + z * vz), self.pace
        if gap <= 0.0:
            least = closing + min(-self.rate * gap, recovery)
        elif max(speed, own + closing) * self.rate <= self.braking:  # both ways are linear
            least = closing - self.rate * gap
        else:
            time = self.way(speed) / speed if speed > 0.0 and (own > 0.0 or closing <= 0.0) else 1.0 / self.rate
            slope = time + self.growth(own + closing) - self.growth(own)
            least = time * own + self.way(own + closing) - self.way(own) - gap - slope * own
            tilt = (self.growth(speed) - time) * own / (speed * speed) if own > 0.0 else 0.0
            x, y, z = slope * x - tilt * vx, slope * y - tilt * vy, slope * z - tilt * vz
            length = sqrt(x * x + y * y + z * z)
            x, y, z, least = x / length, y / length, z / length, (least - tilt * speed * speed) / length
        return (x, y, z, least) if least > -self.speed else None


def nearest_on_segment(start: Vector, end: Vector) -> Vector:
    """Return the point of the segment nearest to the origin."""
    dx, dy, dz = end[0] - start[0], end[1] - start[1], end[2] - start[2]
    square = dx * dx + dy * dy + dz * dz
    if square < _COINCIDENT * _COINCIDENT:
        return start
    t = -(start[0] * dx + start[1] * dy + start[2] * dz) / square
    if t <= 0.0:
        return start
    if t >= 1.0:
        return end
    return (start[0] + t * dx, start[1] + t * dy, start[2] + t * dz)


def keep_clear(
    separation: Vector,
    stopping: Vector,
    velocity: Vector,
    body_velocity: Vector,
    shared: bool,
    safety_distance: float,
    approach: Approach,
    recovery: float = inf,
) -> HalfSpace | None:
    """Return the half-space of velocities that avoid one body, None if every velocity does.

        z on the segment from `separation` to `stopping` nearest to the origin,   n = z / |z|,   g = |z| − r
        the gap g to a plane that comes at c = n·v_body; for a body that yields also the gap S to one that stands:
        S = g/2 + clamp((h_i − h)/2, −0.2 g, 0.2 g),   g/2 for g <= 0              (ours)

    h = c R(|v_body|)/|v_body| and h_i, likewise of −n·v, are what both need to brake. `separation` is x − x_body in m;
    `stopping` the same difference after both have stopped if the command is zero from now on: no command can change the
    path between. `velocity` v and `body_velocity` in m/s, `safety_distance` r in m. The shares of two that yield add up
    to g, and the larger one has who moves. One that does not yield need not be known: it leaves the less.
    """
    z = nearest_on_segment(separation, stopping)
    distance = norm(z)
    gap = distance - safety_distance
    if distance < _COINCIDENT:
        z, distance, gap = separation, max(norm(separation), _COINCIDENT), -safety_distance
    x, y, z_ = normal = (z[0] / distance, z[1] / distance, z[2] / distance)
    vx, vy, vz = velocity
    wx, wy, wz = body_velocity
    closing = x * wx + y * wy + z_ * wz
    space = approach.half_space(normal, gap, closing, recovery)
    if not shared:
        return space
    own, speed, other = -(x * vx + y * vy + z_ * vz), norm(velocity), norm(body_velocity)
    needed = own * approach.way(speed) / speed if speed > 0.0 else 0.0
    taken = closing * approach.way(other) / other if other > 0.0 else 0.0
    most = _SHIFTED * max(gap, 0.0)
    share = approach.half_space(normal, 0.5 * gap + min(max(0.5 * (needed - taken), -most), most))
    if space is None or share is None:
        return space or share
    return space if lack(space, approach.last) >= lack(share, approach.last) else share


def lack(space: HalfSpace, velocity: Vector) -> float:
    """Return by how much, m/s, `velocity` does not satisfy a half-space; negative if it does."""
    x, y, z, least = space
    return least - x * velocity[0] - y * velocity[1] - z * velocity[2]


def speed_and_acceleration(last: Vector, speed: float, change: float) -> tuple[Vector, float, HalfSpace | None]:
    """Return a ball and, if needed, a half-space whose intersection satisfies both limits.

        |v| <= v_max   and   |v − v_last| <= a dt        (ours)

    `speed` is v_max, `change` a dt, both m/s. The ball around v_last ends at the plane in which the two spheres meet (n
    = −v_last / |v_last|); beyond it is only a sliver of the ball of speeds. If a step can stop the drone, that is no
    sliver: then it is the ball that touches both spheres, between the hardest braking and the speed limit.
    """
    x, y, z = last
    length = sqrt(x * x + y * y + z * z)
    if length + change <= speed:
        return last, change, None
    if length <= change:
        middle = max(0.5 * (speed + length - change), 0.0)
        return scale(last, middle / max(length, _COINCIDENT)), speed - middle, None
    meet = (speed * speed + length * length - change * change) / (2.0 * length)
    plane = (-x / length, -y / length, -z / length, -meet)
    return last, change, plane


def sight_speed(sight: float, safety_distance: float, delay: float, braking: float, silence: float) -> float:
    """Return the speed, m/s, at which two drones that meet head on with `sight` m can still stop in time.

        2 v tau + v^2 / b <= sight − r,   2 v t_s <= sight − r/2

    `delay` is tau in s: lag, dead time and the delay until the body's velocity is known; `braking` b in m/s^2;
    `silence` is t_s in s: until each stands if no command reaches it any more.
    """
    room = max(sight - safety_distance, 0.0)
    return min(
        braking * (sqrt(delay * delay + room / braking) - delay), (sight - safety_distance / 2.0) / (2.0 * silence)
    )
