"""The velocity obstacle of a body within a horizon, and the half-plane that leaves it."""

from __future__ import annotations

from math import hypot

from flockwire_core.control.safety_filter import HalfSpace
from flockwire_core.law import Body, Vector


def half_plane(velocity: Vector, body: Body, radius: float, share: float, horizon: float) -> HalfSpace:
    """Return (n, bound) with n'v >= n'v_now + share n'w, of VO = {v : |t v − p| < radius for a t in (0, horizon]}.

    `velocity` is v_now (m/s), p the body's relative position (m); w, along n, is the smallest change of the relative
    velocity that leaves VO; `horizon` in s.
    """
    (x, y, _), (vx, vy, _) = body.relative_position, velocity
    wx, wy = vx - body.velocity[0], vy - body.velocity[1]
    distance = max(hypot(x, y), 1e-6)
    cx, cy = wx - x / horizon, wy - y / horizon
    if distance <= radius:  # inside: away
        n, missing = (-x / distance, -y / distance), (radius - distance) / horizon + (wx * x + wy * y) / distance
    elif cx * x + cy * y < 0.0 and (cx * x + cy * y) ** 2 > radius**2 * (cx * cx + cy * cy):  # the round end
        length = hypot(cx, cy)
        n, missing = (cx / length, cy / length), radius / horizon - length
    else:
        side = 1.0 if x * wy - y * wx > -1e-3 * distance else -1.0  # head on: all to the same side
        leg = (distance * distance - radius * radius) ** 0.5
        ax, ay = (x * leg - side * y * radius) / distance**2, (y * leg + side * x * radius) / distance**2
        n = (-side * ay, side * ax)
        missing = -(n[0] * wx + n[1] * wy)
    nx, ny = n
    return (nx, ny, 0.0, nx * vx + ny * vy + share * missing)
