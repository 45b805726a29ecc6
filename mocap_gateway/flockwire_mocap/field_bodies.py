"""All bodies on the field, seen by an on-board sensor of each drone: relative, without identities."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import floor
from typing import Final, NamedTuple

from flockwire_core.control.tracker import VelocityTracker
from flockwire_core.domain.body import Body, BodyKind, to_axis
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.record import Frozen
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.domain.vector import Vector, distance, norm
from flockwire_core.swarm.model import Swarm

from flockwire_mocap.lost_body import STILL, LostBody, drone_spread, person_spread
from flockwire_mocap.tracking import Drone

COLUMN: Final = 1 << 20  # cells, more than a field is wide
AROUND: Final = [i * COLUMN + j for i in (-1, 0, 1) for j in (-1, 0, 1)]


class Vicinity:
    """The `places` (m), sorted into upright columns of `reach` x `reach` m, each with those round it."""

    def __init__(self, places: Iterable[Vector], reach: float) -> None:
        self._reach = reach
        self._near: dict[int, list[int]] = {}
        for k, place in enumerate(places):
            cell = self._cell(place)
            for other in AROUND:
                self._near.setdefault(cell + other, []).append(k)

    def round(self, position: Vector) -> list[int]:
        """Return the indices of all places that may be within reach of `position`, ascending."""
        return self._near.get(self._cell(position), [])

    def _cell(self, place: Vector) -> int:
        return COLUMN * floor(place[0] / self._reach) + floor(place[1] / self._reach)


DRONE: Final = BodyKind.DRONE  # compiled, a constant costs less than an attribute
OBSTACLE: Final = BodyKind.OBSTACLE
FEW: Final = 30  # bodies up to which each drone checks all others
FORGET: Final = SECOND  # ns unseen after which a velocity is dropped, and a stray body is gone
LEFT: Final = 5 * SECOND  # ns after which an unseen person counts as gone
SAME: Final = 0.05  # m: two names so near are on one body
MOST_MOVERS: Final = 500  # other bodies that are kept; beyond that unseen ones are dropped


class Stray(NamedTuple):
    """The body that has a drone's name, but is not the drone, or is carried by a person."""

    drone: int


Called = str | int | Stray  # a body's name; without one the tracker's number: it may turn out to be a drone's


class Cylinder(NamedTuple):
    """An upright cylinder round a tracked body; endless without a height. m."""

    radius: float
    height: float | None = None


@dataclass(frozen=True, slots=True)
class Pillar(Frozen):
    """An obstacle: upright, with its axis at `center`; without a `height` endless. m."""

    center: Vector
    radius: float
    height: float | None


class Mover:
    """A moving body that is not a drone: its last place, velocity and size."""

    def __init__(self, shape: Cylinder, position: Vector, stamp: int) -> None:
        self.shape, self.position, self.stamp = shape, position, stamp
        self.radius, self._height = shape
        self._epoch = stamp
        self.tracker = VelocityTracker(0.05, position, 0.0)  # s, of the velocity trackers

    def update(self, position: Vector, stamp: int) -> None:
        """Record its position at `stamp` (ns)."""
        self.position, self.stamp = position, stamp
        self.tracker.update(position, (stamp - self._epoch) / SECOND)

    def near(self, position: Vector, reach: float) -> Body | None:
        """Return it relative to `position` (m), None if its surface is `reach` m away or more."""
        relative = to_axis(position, self.position, self._height)
        if norm(relative) - self.radius >= reach:
            return None
        return Body(BodyKind.MOVER, relative, self.radius, self.tracker.velocity)


class FieldBodies:
    """The drones, obstacles and other bodies of `swarm`."""

    def __init__(self, swarm: Swarm) -> None:
        table, safe = swarm.gateway, swarm.avoidance
        self._swarm = swarm
        self._lost_after = nanoseconds(swarm.limits.staleness.pose_zero)  # ns: then its pilot stops it
        self._drone_radius = max(safe.kept.drone - safe.kept.obstacle, 0.0)
        self._reach = safe.sensing_radius
        self._obstacles = [Pillar(one.center, one.radius, one.height) for one in swarm.obstacles]
        self._shapes = {one.body: Cylinder(one.radius, one.height) for one in swarm.tracked_obstacles}
        self._carried = frozenset(swarm.carried)
        self._usual = Cylinder(table.person_radius)
        self._drones: dict[int, Pose] = {}
        self._movers: dict[Called, Mover] = {}
        self._here: dict[int, Pose] = {}  # those of the drones that are not lost
        self._all: list[Drone] = []  # the same
        self._others: list[tuple[int | None, Mover | LostBody]] = []  # each with the drone that it may be
        self._vicinity: Vicinity | None = None

    @property
    def others(self) -> tuple[str | int, ...]:
        """The names, or without one the numbers, of the bodies that are not drones."""
        return tuple(called for called in self._movers if not isinstance(called, Stray))

    def see_drone(self, drone: int, pose: Pose) -> None:
        """Record a drone's position; a leader that a person carries is a person."""
        if self._carried and drone in self._carried:
            self.see_other(Stray(drone), pose.stamp, pose.position)
        else:
            self._drones[drone] = pose
            if self._movers:
                self._movers.pop(Stray(drone), None)

    def see_other(self, called: Called, stamp: int, position: Vector) -> None:
        """Record the position of another body at `stamp` (ns)."""
        mover = self._movers.get(called)
        if mover is not None and stamp - mover.stamp < FORGET:
            mover.update(position, stamp)
        elif mover is not None or len(self._movers) < MOST_MOVERS:
            self._movers[called] = Mover(self._shape(called), position, stamp)

    def forget_unnamed(self, identity: int) -> None:
        """Take it that the body with the tracker's number `identity` has got its name."""
        if self._movers:
            self._movers.pop(identity, None)

    def forget_drones(self, drones: Iterable[int]) -> None:
        """Drop those of `drones` that are not seen: they are not on the field."""
        for drone in drones:
            self._drones.pop(drone, None)

    def arrange(self, now: int) -> None:
        """Sort the bodies by place; call it once before all calls to `near`.

        `now` is the newest sighting, Unix ns; earlier ones have an age.
        """
        seen_from = now - self._lost_after
        self._here = {drone: pose for drone, pose in self._drones.items() if pose.stamp >= seen_from}
        self._all = list(self._here.items())
        self._others = [(i, self._lost_drone(i, now)) for i in self._drones if i not in self._here]
        if self._movers:
            self._arrange_movers(now, seen_from)
        self._vicinity = None
        if len(self._here) + len(self._others) > FEW:
            widest = max((other.radius for _, other in self._others), default=0.0)
            places = [*(pose.position for _, pose in self._all), *(other.position for _, other in self._others)]
            self._vicinity = Vicinity(places, self._reach + widest)

    def _arrange_movers(self, now: int, seen_from: int) -> None:
        movers = {called: one for called, one in self._movers.items() if self._lasts(called, now - one.stamp)}
        if len(self._movers) >= MOST_MOVERS:
            self._movers = movers
        for called, mover in movers.items():
            drone = called.drone if isinstance(called, Stray) else None
            if drone is None or not self._is_drone(mover.position):
                lost = mover.stamp < seen_from
                self._others.append((drone, self._lost_mover(called, mover, now) if lost else mover))

    def near(self, drone: int, position: Vector) -> tuple[Body, ...]:
        """Return the bodies within the sensing radius of `drone`, which is at `position` (m)."""
        drones, others = self._all, self._others
        if self._vicinity is not None:
            places, count = self._vicinity.round(position), len(drones)
            drones, others = [drones[k] for k in places if k < count], [others[k - count] for k in places if k >= count]
        bodies = self._near_drones(drones, drone, position)
        bodies += [body for owner, one in others if owner != drone and (body := one.near(position, self._reach))]
        if self._obstacles:
            self._add_obstacles(bodies, position)
        return tuple(bodies)

    def _near_drones(self, drones: list[Drone], drone: int, position: Vector) -> list[Body]:
        bodies, reach = list[Body](), self._reach
        for other, pose in drones:
            if other != drone:
                place = pose.position
                dx, dy, dz = place[0] - position[0], place[1] - position[1], place[2] - position[2]
                if SAME * SAME < dx * dx + dy * dy + dz * dz < reach * reach:
                    bodies.append(Body(DRONE, (dx, dy, dz), 0.0))
        return bodies

    def _add_obstacles(self, bodies: list[Body], position: Vector) -> None:
        for obstacle in self._obstacles:
            relative = to_axis(position, obstacle.center, obstacle.height)
            dx, dy, dz = relative
            if dx * dx + dy * dy + dz * dz < (self._reach + obstacle.radius) ** 2:
                bodies.append(Body(OBSTACLE, relative, obstacle.radius))

    def _lost_drone(self, drone: int, now: int) -> LostBody:
        pose = self._drones[drone]
        place, age = pose.position, (now - pose.stamp) / SECOND
        spread = drone_spread(self._swarm, drone, place[2])
        return LostBody(place, place[2], self._drone_radius + spread.reach(age), spread.growth(age))

    def _shape(self, called: Called) -> Cylinder:
        return self._shapes.get(called, self._usual) if isinstance(called, str) else self._usual

    def _lost_mover(self, called: Called, mover: Mover, now: int) -> LostBody:
        shape, walks = mover.shape, self._walks(called)
        spread, age = person_spread(norm(mover.tracker.velocity)) if walks else STILL, (now - mover.stamp) / SECOND
        return LostBody(mover.position, shape.height, shape.radius + spread.reach(age), spread.growth(age))

    def _is_drone(self, position: Vector) -> bool:
        return any(distance(pose.position, position) < SAME for _, pose in self._all)

    def _walks(self, called: Called) -> bool:
        if isinstance(called, Stray):
            return bool(self._carried)
        return called not in self._shapes

    def _lasts(self, called: Called, age: int) -> bool:
        """Return whether a body that was seen `age` ns ago is still kept.

        An obstacle and the person who carries the leader are kept. The place of a drone whose name strayed is kept as
        its own.
        """
        if called in self._shapes or (self._carried and isinstance(called, Stray) and called.drone in self._carried):
            return True
        return age < (FORGET if isinstance(called, Stray) else LEFT)
