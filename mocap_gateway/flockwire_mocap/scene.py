"""All bodies on the field, as a sensor on board of each drone would see them: relative, without identities."""

from __future__ import annotations

from math import dist
from typing import NamedTuple

from flockwire.control.graph import LEADER
from flockwire.control.obstacle import to_axis
from flockwire.control.tracker import VelocityTracker
from flockwire.control.vector import Vector, norm, subtract
from flockwire.nanoseconds import BILLION
from flockwire.swarm.model import Swarm
from flockwire.wire.messages import Body, BodyKind

from flockwire_mocap.vicinity import Vicinity

FEW = 30  # bodies up to which each drone looks at all others
FORGET = BILLION  # ns after which a body that is no longer seen is no longer near anybody
MOST_MOVERS = 500  # bodies of no drone that are kept; beyond that those are forgotten that are no longer seen
TIME_CONSTANT = 0.05  # s, of the trackers of their velocities


CARRIED = "said to be the leader's"  # what the body is called of a person who carries the leader


def held_name(drone: int) -> str:
    """Return what a body is called that is said to be a drone's, and is not believed to be."""
    return f"said to be drone {drone}'s"


class Shape(NamedTuple):
    """An upright cylinder round a tracked body; endless without a height. m."""

    radius: float
    height: float | None = None


class Mover:
    """A body that moves and is no drone's: where it was seen last, how fast it moves, how large it is."""

    def __init__(self, shape: Shape, position: Vector, stamp: int) -> None:
        self.shape, self.position, self.stamp = shape, position, stamp
        self._epoch = stamp
        self._tracker = VelocityTracker(TIME_CONSTANT, position, 0.0)

    @property
    def velocity(self) -> Vector:
        """The velocity, m/s."""
        return self._tracker.velocity

    def update(self, position: Vector, stamp: int) -> None:
        """Take where it was at `stamp` (ns)."""
        self.position, self.stamp = position, stamp
        self._tracker.update(position, (stamp - self._epoch) / BILLION)


class Scene:
    """The drones, obstacles and other bodies of `swarm`. Drones have their ids, movers numbers below 0."""

    def __init__(self, swarm: Swarm) -> None:
        table = swarm.gateway
        self._reach, self._obstacles = swarm.avoidance.sensing_radius, swarm.obstacles
        self._shapes = {obstacle.body: Shape(obstacle.radius, obstacle.height) for obstacle in swarm.tracked_obstacles}
        self._carried = frozenset({LEADER} if swarm.leader.kind == "tracked" else ())
        self._usual = Shape(table.person_radius)
        self._widest = max(shape.radius for shape in (self._usual, *self._shapes.values()))
        self._drones: dict[int, tuple[int, Vector]] = {}
        self._movers: dict[str, Mover] = {}
        self._places: dict[int, Vector] = {}
        self._by_place: dict[int, Mover] = {}
        self._vicinity: Vicinity | None = None

    @property
    def others(self) -> tuple[str, ...]:
        """The names of the bodies that are no drone's."""
        return tuple(name for name in self._movers if not name.startswith("said to be"))

    def see_drone(self, drone: int, stamp: int, position: Vector) -> None:
        """Take where a drone was at `stamp` (ns); a leader that a person carries is a person."""
        if drone in self._carried:
            self.see_other(CARRIED, stamp, position)
        else:
            self._drones[drone] = (stamp, position)
        if self._movers:
            self._movers.pop(held_name(drone), None)

    def see_held(self, drone: int, stamp: int, position: Vector) -> None:
        """Take where a body was at `stamp` (ns) that bears a drone's name and is not believed to be its."""
        self.see_other(held_name(drone), stamp, position)

    def see_other(self, name: str, stamp: int, position: Vector) -> None:
        """Take where a body that is no drone's was at `stamp` (ns)."""
        mover = self._movers.get(name)
        if mover is not None and stamp - mover.stamp < FORGET:
            mover.update(position, stamp)
        elif mover is not None or len(self._movers) < MOST_MOVERS:
            self._movers[name] = Mover(self._shapes.get(name, self._usual), position, stamp)

    def forget_other(self, name: str) -> None:
        """Take it that this body has turned out to be a drone's."""
        if self._movers:
            self._movers.pop(name, None)

    def arrange(self, now: int) -> None:
        """Sort what has been seen lately by place: call it once before all calls to `near`; `now` in Unix ns."""
        self._places = {drone: place for drone, (stamp, place) in self._drones.items() if now - stamp < FORGET}
        seen = {name: one for name, one in self._movers.items() if self._lasts(name) or now - one.stamp < FORGET}
        if len(self._movers) >= MOST_MOVERS:
            self._movers = seen
        self._by_place = {-1 - k: mover for k, mover in enumerate(seen.values())}
        self._places |= {key: mover.position for key, mover in self._by_place.items()}
        few = len(self._places) <= FEW
        self._vicinity = None if few else Vicinity(self._places, self._reach + (self._widest if seen else 0.0))

    def near(self, drone: int, position: Vector) -> tuple[Body, ...]:
        """Return what is within the sensing radius of `drone`, which is at `position` (m)."""
        places, reach = self._places, self._reach
        keys = self._vicinity.round(position) if self._vicinity is not None else places
        bodies = [
            Body(BodyKind.DRONE, subtract(place, position), 0.0)
            for key in keys
            if key >= 0 and key != drone and dist(place := places[key], position) < reach
        ]
        if self._by_place:
            bodies += [body for key in keys if key < 0 and (body := self._mover(self._by_place[key], position))]
        for obstacle in self._obstacles:
            relative = to_axis(position, obstacle.center, obstacle.height)
            if norm(relative) - obstacle.radius < reach:
                bodies.append(Body(BodyKind.OBSTACLE, relative, obstacle.radius))
        return tuple(bodies)

    def _mover(self, mover: Mover, position: Vector) -> Body | None:
        relative = to_axis(position, mover.position, mover.shape.height)
        if norm(relative) - mover.shape.radius >= self._reach:
            return None
        return Body(BodyKind.MOVER, relative, mover.shape.radius, mover.velocity)

    def _lasts(self, name: str) -> bool:
        """Return whether a body stays where it was seen last: an obstacle whose markers are hidden is still there."""
        return name in self._shapes
