"""The room that no drone may leave: a box, optionally intersected with the upright prism over a polygon."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import hypot, inf

from flockwire_core.control.barrier import Approach
from flockwire_core.control.plane_polygon import Corner, clearance, edges, inward_normal, nearest_on_edge
from flockwire_core.control.safety_filter import HalfSpace
from flockwire_core.domain.record import Frozen
from flockwire_core.domain.vector import Vector, scale, subtract


@dataclass(frozen=True, slots=True)
class Room(Frozen):
    """From `low` to `high` (m, world frame); horizontally within the polygon of `corners`, if there is one."""

    low: Vector
    high: Vector
    corners: tuple[Corner, ...] = ()

    def walls(self) -> Iterator[tuple[Corner, Corner]]:
        """Yield the walls in the horizontal plane, each from corner to corner: those of the box, then the polygon's."""
        (a, b, _), (d, e, _) = self.low, self.high
        yield from edges(((a, b), (d, b), (d, e), (a, e)))
        if self.corners:
            yield from edges(self.corners)

    def outside(self, position: Vector) -> float:
        """Return the distance of `position` outside, m (the largest excess; 0 inside)."""
        x, y, z = position
        a, b, c = self.low
        d, e, f = self.high
        beyond = 0.0
        if not (a <= x <= d and b <= y <= e and c <= z <= f):
            beyond = max(a - x, x - d, b - y, y - e, c - z, z - f)
        if not self.corners:
            return beyond
        return max(beyond, -clearance(self.corners, (x, y))[0])

    def sides(self, position: Vector) -> Iterator[tuple[float, Vector]]:
        """Yield the distance of `position` from each side and the nearest wall, m, and the outward direction."""
        for axis, (p, low, high) in enumerate(zip(position, self.low, self.high, strict=True)):
            out = (float(axis == 0), float(axis == 1), float(axis == 2))
            yield high - p, out
            yield p - low, (-out[0], -out[1], -out[2])
        if self.corners:
            distance, (nx, ny) = clearance(self.corners, position[:2])
            yield distance, (-nx, -ny, 0.0)

    def inwards(self, velocity: Vector, position: Vector) -> Vector:
        """Return `velocity` (m/s) without its outward component at the boundary or outside."""
        x, y, z = position
        a, b, c = self.low
        d, e, f = self.high
        if a < x < d and b < y < e and c < z < f and not self.corners:  # as in nearly all steps
            return velocity
        for distance, out in self.sides(position):
            along = out[0] * velocity[0] + out[1] * velocity[1] + out[2] * velocity[2]
            if distance <= 0.0 and along > 0.0:
                velocity = subtract(velocity, scale(out, along))
        return velocity

    def half_spaces(
        self, position: Vector, stopping: Vector, floor: float, approach: Approach, recovery: float = inf
    ) -> list[HalfSpace]:
        """Return the half-spaces of velocities that stay in the room above `floor` (m), or come back to it.

        Each face keeps the gap from the `position` or the `stopping` point (m), whichever is less; each edge of a
        polygon is a separate wall, n from its nearest point to the path from the one to the other. Outside, n leads
        straight back, and no other edge counts. `recovery` in m/s, at most, back from outside.
        """
        px, py, pz = position
        qx, qy, qz = stopping
        a, b, c = self.low
        d, e, f = self.high
        found = [
            approach.half_space((1.0, 0.0, 0.0), min(px, qx) - a, 0.0, recovery),
            approach.half_space((-1.0, 0.0, 0.0), d - max(px, qx), 0.0, recovery),
            approach.half_space((0.0, 1.0, 0.0), min(py, qy) - b, 0.0, recovery),
            approach.half_space((0.0, -1.0, 0.0), e - max(py, qy), 0.0, recovery),
            approach.half_space((0.0, 0.0, 1.0), min(pz, qz) - max(c, floor), 0.0, recovery),
            approach.half_space((0.0, 0.0, -1.0), f - max(pz, qz), 0.0, recovery),
        ]
        if self.corners:
            ends = (position[:2], stopping[:2])
            gap, (nx, ny) = min(clearance(self.corners, end) for end in ends)
            walls = [(gap, (nx, ny))] if gap <= 0.0 else [self._away(edge, ends) for edge in edges(self.corners)]
            found += [approach.half_space((nx, ny, 0.0), gap, recovery=recovery) for gap, (nx, ny) in walls]
        return [space for space in found if space is not None]

    def _away(self, edge: tuple[Corner, Corner], way: tuple[Corner, Corner]) -> tuple[float, Corner]:
        """Return the distance, m, between an edge and a way, and the unit vector from the one to the other."""
        gaps = [(nearest_on_edge(end, edge), end) for end in way]
        gaps += [(end, nearest_on_edge(end, way)) for end in edge]
        (ax, ay), (bx, by) = min(gaps, key=lambda gap: hypot(gap[1][0] - gap[0][0], gap[1][1] - gap[0][1]))
        distance = hypot(bx - ax, by - ay)
        if distance <= 1e-9:  # m: the way touches it
            return 0.0, inward_normal(self.corners, edge)
        return distance, ((bx - ax) / distance, (by - ay) / distance)
