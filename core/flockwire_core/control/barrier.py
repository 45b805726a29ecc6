"""The barrier: the allowed approach speed to bodies and walls, as half-spaces for the safety filter."""

from __future__ import annotations

from math import hypot, inf, sqrt
from typing import Final

from flockwire_core.control.safety_filter import HalfSpace
from flockwire_core.domain.vector import Vector

_COINCIDENT: Final = 1e-9
_SHIFTED: Final = 0.2  # of A, more than half, for a drone that moves; more pushes one at its place (docs/theory.md)


def approach_speed(gap: float, rate: float, braking: float) -> float:
    """Return the speed A, m/s, at which `gap` (m, beyond the safety distance) may shrink; negative: it must grow.

        A = alpha g                           for g <= g_1 = b / alpha^2
        A = sqrt(2 b (g − g_1 / 2))           beyond        (ours)

    `rate` is alpha in 1/s, `braking` the largest deceleration b in m/s^2 that A requires; both branches meet with the
    same slope. With g' >= −A(g) the gap decays to 0 and never passes it; sampled every dt while alpha dt <= 1.
    """
    knee = braking / (rate * rate)
    return rate * gap if gap <= knee else sqrt(2.0 * braking * (gap - 0.5 * knee))


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
    rate: float,
    braking: float,
    speed: float,
    recovery: float = inf,
) -> HalfSpace | None:
    """Return the half-space of velocities that avoid one body, None if every velocity does.

        z on the segment from `separation` to `stopping` nearest to the origin,   n = z / |z|,   g = |z| − r
        n·u >= −min(S, A(g) − c)   for a body that yields,      c = n·v_body,   c_i = −n·v
        S = A(g)/2 + clamp((c_i − c)/2, −0.2 A(g), 0.2 A(g)),   A(g)/2 for A(g) <= 0
        n·u >= −A(g) + c           for one that does not              (ours)

    `separation` is x − x_body in m; `stopping` the same difference after both have stopped if the command is zero from
    now on: no command can change the path between. `velocity` v and `body_velocity` in m/s, `safety_distance` r in m.
    The shares of two that yield add up to A(g), and the larger one has who moves. What a body takes beyond its share
    reduces ours, so bodies that do not yield need not be known. `speed` is the largest |u|. A(g) is at least
    −`recovery`, m/s: the speed limit out of a body that has grown around us.
    """
    z = nearest_on_segment(separation, stopping)
    distance = hypot(*z)
    gap = distance - safety_distance
    if distance < _COINCIDENT:
        z, distance, gap = separation, max(hypot(*separation), _COINCIDENT), -safety_distance
    x, y, z_ = z[0] / distance, z[1] / distance, z[2] / distance
    allowed = max(approach_speed(gap, rate, braking), -recovery)
    closing = x * body_velocity[0] + y * body_velocity[1] + z_ * body_velocity[2]
    least = closing - allowed
    if shared:
        own = -(x * velocity[0] + y * velocity[1] + z_ * velocity[2])
        most = _SHIFTED * max(allowed, 0.0)
        share = 0.5 * allowed + min(max(0.5 * (own - closing), -most), most)
        least = max(-share, least)
    return (x, y, z_, least) if least > -speed else None


def keep_inside(
    position: Vector,
    stopping: Vector,
    low: Vector,
    high: Vector,
    rate: float,
    braking: float,
    speed: float,
    recovery: float = inf,
) -> list[HalfSpace]:
    """Return the half-spaces of velocities that stay in the box `low` … `high`, m, or come back to it.

        n·u >= −A(g),   g the distance to the face, from here or from the stopping point, whichever is less

    Faces that no velocity up to `speed`, m/s, reaches are left out. A(g) is at least −`recovery`, m/s.
    """
    found: list[HalfSpace] = []
    for k in range(3):
        near, far = position[k], stopping[k]
        if near > far:
            near, far = far, near
        least = min(-approach_speed(near - low[k], rate, braking), recovery)
        if least > -speed:
            found.append((float(k == 0), float(k == 1), float(k == 2), least))
        least = min(-approach_speed(high[k] - far, rate, braking), recovery)
        if least > -speed:
            found.append((-float(k == 0), -float(k == 1), -float(k == 2), least))
    return found


def speed_and_acceleration(last: Vector, speed: float, change: float) -> tuple[Vector, float, HalfSpace | None]:
    """Return a ball and, if needed, a half-space whose intersection satisfies both limits.

        |v| <= v_max   and   |v − v_last| <= a dt        (ours)

    `speed` is v_max, `change` a dt, both m/s. The ball around v_last ends at the plane in which the two spheres meet (n
    = −v_last / |v_last|); beyond it is only a sliver of the ball of speeds.
    """
    length = hypot(*last)
    if length + change <= speed:
        return last, change, None
    if length <= _COINCIDENT or change >= speed + length:
        return (0.0, 0.0, 0.0), speed, None
    meet = (speed * speed + length * length - change * change) / (2.0 * length)
    plane = (-last[0] / length, -last[1] / length, -last[2] / length, -meet)
    return last, change, plane


def sight_speed(sight: float, safety_distance: float, delay: float, braking: float) -> float:
    """Return the speed, m/s, at which two drones that meet head on with `sight` m can still stop in time.

        2 v tau + v^2 / b <= sight − r

    `delay` is tau in s: lag, dead time and the delay until the body's velocity is known; `braking` b in m/s^2.
    """
    room = max(sight - safety_distance, 0.0)
    return braking * (sqrt(delay * delay + room / braking) - delay)
