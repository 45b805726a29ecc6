"""All bodies on the field, as a sensor on board of each drone would see them: relative, without identities."""

from __future__ import annotations

from collections.abc import Iterable
from math import dist
from typing import NamedTuple

from flockwire.control.graph import LEADER
from flockwire.control.tracker import VelocityTracker
from flockwire.domain.body import Body, BodyKind, to_axis
from flockwire.domain.fields import from_fields
from flockwire.domain.time import SECOND, nanoseconds
from flockwire.domain.vector import ZERO, Vector, norm, subtract
from flockwire.swarm.model import Swarm

from flockwire_mocap.lost_body import STILL, LostBody, drone_spread, person_spread
from flockwire_mocap.vicinity import Vicinity

FEW = 30  # bodies up to which each drone looks at all others
FORGET = SECOND  # ns unseen after which nothing is left of a velocity, and a body that is not believed is gone
LEFT = 5 * SECOND  # ns after which a person who is not seen has left, or is where nobody can say
MOST_MOVERS = 500  # bodies of no drone that are kept; beyond that those are forgotten that are no longer seen
TIME_CONSTANT = 0.05  # s, of the trackers of their velocities
MOVERS = -1001  # the number of the first; those above it are of lost drones
CARRIED = "said to be the leader's"  # what the body is called of a person who carries the leader


def held_name(drone: int) -> str:
    """Return what a body is called that is said to be a drone's, and is not believed to be."""
    return f"said to be drone {drone}'s"


def _lost(drone: int) -> int:
    return -1 - drone


class Cylinder(NamedTuple):
    """An upright cylinder round a tracked body; endless without a height. m."""

    radius: float
    height: float | None = None


def unnamed(identity: int) -> str:
    """Return what a body is called until the tracker has sent its name: it may turn out to be a drone's."""
    return f"number {identity}"


class Mover:
    """A body that moves and is no drone's: where it was seen last, how fast it moves, how large it is."""

    def __init__(self, shape: Cylinder, position: Vector, stamp: int) -> None:
        self.shape, self.position, self.stamp = shape, position, stamp
        self.radius, self._height = shape
        self._epoch = stamp
        self._tracker = VelocityTracker(TIME_CONSTANT, position, 0.0)

    @property
    def velocity(self) -> Vector:
        """The velocity, m/s."""
        return self._tracker.velocity

    def update(self, position: Vector, stamp: int) -> None:
        """Take where it was at `stamp` (ns)."""
        self.position, self.stamp = position, stamp
        self._tracker.update(position, (stamp - self._epoch) / SECOND)

    def near(self, position: Vector, reach: float) -> Body | None:
        """Return it as seen from `position` (m), None if its surface is `reach` m away or more."""
        relative = to_axis(position, self.position, self._height)
        if norm(relative) - self.radius >= reach:
            return None
        return Body(BodyKind.MOVER, relative, self.radius, self._tracker.velocity)


class FieldBodies:
    """The drones, obstacles and other bodies of `swarm`. What is no drone, or not seen, has a number below 0."""

    def __init__(self, swarm: Swarm) -> None:
        table, safe = swarm.gateway, swarm.avoidance
        self._swarm = swarm
        self._lost_after = nanoseconds(swarm.limits.staleness.pose_zero)  # ns: then its own pilot stops it
        self._drone_radius = max(safe.kept.drone - safe.kept.obstacle, 0.0)
        self._reach, self._obstacles = safe.sensing_radius, swarm.obstacles
        self._shapes = {one.body: Cylinder(one.radius, one.height) for one in swarm.tracked_obstacles}
        self._carried = frozenset({LEADER} if swarm.leader.kind == "tracked" else ())
        self._usual = Cylinder(table.person_radius)
        self._held = frozenset(map(held_name, swarm.tracked))
        self._drones: dict[int, tuple[int, Vector]] = {}
        self._movers: dict[str, Mover] = {}
        self._places: dict[int, Vector] = {}
        self._others: dict[int, Mover | LostBody] = {}
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

    def forget_unnamed(self, identity: int) -> None:
        """Take it that the body with the tracker's number `identity` has turned out to be a drone's."""
        if self._movers:
            self._movers.pop(unnamed(identity), None)

    def forget_drones(self, drones: Iterable[int]) -> None:
        """Take it that those of `drones` that are not seen are gone from the field."""
        for drone in drones:
            self._drones.pop(drone, None)

    def arrange(self, now: int) -> None:
        """Sort what has been seen by place: call it once before all calls to `near`.

        `now` is when the newest was seen, Unix ns; what was seen before has an age.
        """
        seen_from = now - self._lost_after
        self._places = {drone: place for drone, (stamp, place) in self._drones.items() if stamp >= seen_from}
        self._others = {}
        if len(self._places) < len(self._drones):
            self._others = {_lost(i): self._lost_drone(i, now) for i in self._drones if i not in self._places}
        movers = {name: one for name, one in self._movers.items() if self._lasts(name, now - one.stamp)}
        if len(self._movers) >= MOST_MOVERS:
            self._movers = movers
        for k, (name, mover) in enumerate(movers.items()):
            self._others[MOVERS - k] = mover if mover.stamp >= seen_from else self._lost_mover(name, mover, now)
        self._places |= {key: other.position for key, other in self._others.items()}
        self._vicinity = None
        if len(self._places) > FEW:
            widest = max((other.radius for other in self._others.values()), default=0.0)
            self._vicinity = Vicinity(self._places, self._reach + widest)

    def near(self, drone: int, position: Vector) -> tuple[Body, ...]:
        """Return what is within the sensing radius of `drone`, which is at `position` (m)."""
        places, reach = self._places, self._reach
        keys = self._vicinity.round(position) if self._vicinity is not None else places
        bodies = [
            from_fields(Body, (BodyKind.DRONE, subtract(place, position), 0.0, ZERO))
            for key in keys
            if key >= 0 and key != drone and dist(place := places[key], position) < reach
        ]
        if self._others:
            others, own = self._others, _lost(drone)
            bodies += [body for key in keys if key < 0 and key != own and (body := others[key].near(position, reach))]
        for obstacle in self._obstacles:
            relative = to_axis(position, obstacle.center, obstacle.height)
            if norm(relative) - obstacle.radius < reach:
                bodies.append(Body(BodyKind.OBSTACLE, relative, obstacle.radius))
        return tuple(bodies)

    def _lost_drone(self, drone: int, now: int) -> LostBody:
        stamp, place = self._drones[drone]
        spread, age = drone_spread(self._swarm, drone, place[2]), (now - stamp) / SECOND
        return LostBody(place, place[2], self._drone_radius + spread.reach(age), spread.growth(age))

    def _lost_mover(self, name: str, mover: Mover, now: int) -> LostBody:
        shape, walks = mover.shape, name not in self._shapes and name not in self._held
        spread, age = person_spread(norm(mover.velocity)) if walks else STILL, (now - mover.stamp) / SECOND
        return LostBody(mover.position, shape.height, shape.radius + spread.reach(age), spread.growth(age))

    def _lasts(self, name: str, age: int) -> bool:
        """Return whether a body that was seen `age` ns ago is still there.

        An obstacle and whoever carries the leader stay on the field. A body that was not believed to be a drone's is
        some drone, whose own last place is kept.
        """
        return name in self._shapes or name == CARRIED or age < (FORGET if name in self._held else LEFT)
