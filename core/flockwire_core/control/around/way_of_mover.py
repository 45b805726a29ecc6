"""The way of a mover: a drone that is in it leaves it sideways, it does not flee before the mover."""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot, sqrt

from flockwire_core.control.around.bent_place import SPARE, DetourParameters, stands
from flockwire_core.domain.body import Body, BodyKind
from flockwire_core.domain.vector import ZERO, Vector

EDGE = 0.2  # m on both sides of the way's edge within which the drone slows down
MIDDLE = 0.1  # m from the middle of the way within which the place decides on the side
SHARE = 0.8  # of the speed that the limit leaves beside the mover's


class WayOfMover:
    """Gives one drone's wanted velocity its part across the way of a mover that comes.

        e·u >= v_e min(1, (R − e·r) / EDGE)   if |e·r| < R + EDGE and 0 < a < R + |w| (1 / alpha + t)        (ours)
        v_e = max(v_s, 0.8 sqrt(v_max^2 − |w|^2)),   t = max(0, R − |e·r|) / v_e

    r leads from the mover to the drone's stopping point, w is the mover's velocity, R the distance to keep from its
    axis, and e the unit vector across w to the side on which the drone is, or its place if the drone is in the middle.
    The drone itself is a ahead of the mover, and needs t to leave. Beside the way, e·r > R, this limits how fast it may
    fly in: it waits there, or passes behind the mover.
    """

    def __init__(self, parameters: DetourParameters) -> None:
        self._parameters = parameters
        self._side = 0.0  # +1 left of the mover's way, -1 right; 0: none chosen

    def left(self, wanted: Vector, error: Vector, bodies: Sequence[Body], stopping: Vector = ZERO) -> Vector:
        """Return `wanted`, m/s, with what it lacks to leave the ways of the movers among `bodies`, m from the drone.

        `error` leads from the place to the drone, `stopping` from the drone to its stopping point, m.
        """
        inside, mover = False, BodyKind.MOVER
        for body in bodies:
            if body.kind is mover and not stands(body):
                changed = self._beside(wanted, error, body, stopping)
                if changed is not None:
                    wanted, inside = changed, True
        if not inside:
            self._side = 0.0
        return wanted

    def _beside(self, wanted: Vector, error: Vector, body: Body, stopping: Vector) -> Vector | None:
        """Return `wanted` with its part across the way of `body`, None if the drone is not near it."""
        own, (x, y, _), (wx, wy, _), (sx, sy, _) = self._parameters, body.relative_position, body.velocity, stopping
        speed = hypot(wx, wy)
        ux, uy = wx / speed, wy / speed
        ahead, kept = -ux * x - uy * y, own.separation.from_axis(body) + SPARE
        aside = uy * (x - sx) - ux * (y - sy)
        fastest = max(own.sideways, SHARE * sqrt(max(own.speed * own.speed - speed * speed, 0.0)))
        early = own.early + max(kept - abs(aside), 0.0) / fastest
        if abs(aside) >= kept + EDGE or not 0.0 < ahead < kept + early * speed:
            return None
        if self._side == 0.0 or self._side * aside < -MIDDLE:
            chosen = aside if abs(aside) > MIDDLE else aside - ux * error[1] + uy * error[0]
            self._side = 1.0 if chosen >= 0.0 else -1.0
        ex, ey = -self._side * uy, self._side * ux
        lack = fastest * min(1.0, (kept - self._side * aside) / EDGE) - ex * wanted[0] - ey * wanted[1]
        return (wanted[0] + lack * ex, wanted[1] + lack * ey, wanted[2]) if lack > 0.0 else wanted
