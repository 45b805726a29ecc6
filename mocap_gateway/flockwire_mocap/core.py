"""The gateway without clock, input or output: it serves each drone its pose and what is near it.

It also repeats the operator's newest order twice a second, unchanged, for those who join late.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import dist

from flockwire.control.obstacle import to_axis
from flockwire.control.vector import Vector, norm, subtract
from flockwire.flight.cores import Start
from flockwire.nanoseconds import BILLION
from flockwire.swarm.model import Swarm, uav
from flockwire.wire.keys import MISSION, Key
from flockwire.wire.messages import Body, BodyKind, Message, Mission, Nearby, Pose
from flockwire.wire.status import Report

from flockwire_mocap import simulated
from flockwire_mocap.source import Source
from flockwire_mocap.vicinity import Vicinity

REPEAT = BILLION // 2  # ns between two repetitions of the newest order
FEW = 30  # drones up to which each looks at all others
FORGET = BILLION  # ns after which a body that is no longer seen is no longer near anybody
SOURCES: Mapping[str, Callable[[Start], Source]] = {"simulated": simulated.make_source}  # by gateway.source


class GatewayCore:
    """Poses and nearby bodies of `swarm`, as `source` tracks them."""

    def __init__(self, swarm: Swarm, source: Source) -> None:
        self.triggers = source.triggers
        self.prompt = frozenset({MISSION})
        self.period = 1.0 / swarm.gateway.rate_hz
        self._swarm, self._source = swarm, source
        self._seen: dict[int, tuple[int, Vector]] = {}
        self._sensing = frozenset(swarm.flying) if swarm.avoidance.sensing == "nearby" else frozenset()
        self._recent: dict[int, Vector] = {}
        self._nearby_keys = {i: Key("nearby", uav(i)) for i in swarm.flying}
        self._pose_keys = {i: Key("pose", uav(i)) for i in swarm.flying}
        self._mission: Mission | None = None
        self._repeat_at = 0
        self._last_frame = 0

    def receive(self, key: Key, message: Message, now: int) -> None:
        """Take in a message."""
        self._source.receive(key, message, now)
        if isinstance(message, Mission) and (self._mission is None or message.stamp > self._mission.stamp):
            self._mission, self._repeat_at = message, now + REPEAT

    def due(self, key: Key) -> bool:
        """Return whether the message that was just received completed a frame."""
        return self._source.complete()

    def step(self, now: int) -> list[tuple[Key, Message]]:
        """Publish what was tracked; for each drone what is near it first, then its pose."""
        frame, messages = self._swarm.frame, list[tuple[Key, Message]]()
        tracked = self._source.take(now)
        for stamp, drone, position, _ in tracked:
            self._seen[drone] = (stamp, position)
            self._last_frame = stamp
        vicinity = self._vicinity(now) if tracked else None
        for stamp, drone, position, orientation in sorted(tracked):
            if drone in self._sensing:
                bodies = self._near(drone, position, vicinity)
                messages.append((self._nearby_keys[drone], Nearby(stamp, frame, bodies)))
            messages.append((self._pose_keys[drone], Pose(stamp, frame, position, orientation)))
        if self._mission is not None and now >= self._repeat_at:
            self._repeat_at = now + REPEAT
            messages.append((MISSION, self._mission))
        return messages

    def retire(self, now: int) -> None:
        """Do nothing: poses are served to the end."""

    def may_end(self, now: int) -> bool:
        """Return True: nothing of its own is in the air."""
        return True

    def report(self, now: int) -> Report:
        """Return how the gateway is."""
        if now - self._last_frame > BILLION:
            return Report("waiting", f"waits for {self._source.waits_for}")
        lost = [uav(i) for i in self._swarm.flying if now - self._seen.get(i, (0, None))[0] > BILLION]
        return Report("tracking", f"does not see {', '.join(lost)}" if lost else "")

    def _vicinity(self, now: int) -> Vicinity | None:
        """Return where all are who have been seen lately; None when so few that there is no need to sort them."""
        self._recent = {drone: place for drone, (stamp, place) in self._seen.items() if now - stamp < FORGET}
        return Vicinity(self._recent, self._swarm.avoidance.sensing_radius) if len(self._recent) > FEW else None

    def _near(self, drone: int, position: Vector, vicinity: Vicinity | None) -> tuple[Body, ...]:
        reach = self._swarm.avoidance.sensing_radius
        others = vicinity.round(position) if vicinity is not None else self._recent
        bodies = [
            Body(BodyKind.DRONE, subtract(place, position), 0.0)
            for other in others
            if other != drone and dist(place := self._recent[other], position) < reach
        ]
        for obstacle in self._swarm.obstacles:
            relative = to_axis(position, obstacle.center, obstacle.height)
            if norm(relative) - obstacle.radius < reach:
                bodies.append(Body(BodyKind.OBSTACLE, relative, obstacle.radius))
        return tuple(bodies)


def make_core(start: Start) -> GatewayCore:
    """Return the gateway's core, with the source that the swarm file names."""
    swarm = start.plan.swarm
    return GatewayCore(swarm, SOURCES[swarm.gateway.source](start))
