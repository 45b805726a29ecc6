"""The simulated tracker without sockets: truth in, frames of a real tracker out, with its faults.

Cameras, noise, latency and drop-outs are those of the simulated source; faults between tracker and gateway are added.
"""

from __future__ import annotations

from collections.abc import Callable
from math import inf

from flockwire_core.domain.pose import Pose
from flockwire_core.domain.time import SECOND
from flockwire_core.process.cores import Ground, Randomness, Start
from flockwire_core.swarm.gateway import Twin
from flockwire_core.swarm.model import uav
from flockwire_core.wire.codec import Message
from flockwire_core.wire.keys import Key
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.status import Report
from flockwire_mocap.simulated import SimulatedSource
from flockwire_mocap.streamed import coordinates_of
from flockwire_mocap.tracking import LOST, ReportedBody, TrackerFrame, unseen

AIRBORNE = 0.02  # m above the highest start at which a drone has taken off
UPTIME = 1000 * SECOND  # ns of the tracker's clock at the start of the process: it differs from the swarm's

Deliver = Callable[[TrackerFrame], None]


class TwinCore(Ground):
    """Tracks the simulated airframes of a swarm; calls `deliver` with each frame at its send time."""

    def __init__(self, start: Start) -> None:
        super().__init__()
        self.swarm = swarm = start.plan.swarm
        self.deliver: Deliver | None = None
        gateway = swarm.gateway
        table = gateway.twin
        assert table is not None  # noqa: S101  (without one the swarm has no such process)
        self._cameras = SimulatedSource(start)
        self.triggers = self._cameras.triggers
        self.period = 1.0 / gateway.rate_hz
        self._disturbances = Disturbances(table, start.chance)
        self._coordinates = coordinates_of(gateway)
        self._renamed = table.renamed
        visitors = (unseen(*numbered) for numbered in self._cameras.visitors)
        bodies = map(self._named, (*map(self._unseen, swarm.tracked), *visitors))
        self._bodies = {body.identity: body for body in bodies}
        self._highest = AIRBORNE + max(swarm.drone(i).start[2] for i in swarm.flying)  # m; above it one has taken off
        self._walking = frozenset(Key("truth", uav(i)) for i in swarm.walking)
        self._epoch = start.now - UPTIME
        self._frames = 0

    @property
    def names(self) -> dict[int, str]:
        """The tracker's names for bodies, by number."""
        return {identity: body.name or f"body {identity}" for identity, body in self._bodies.items()}

    def receive(self, key: Key, message: Message, now: int) -> None:
        """Receive an airframe's truth."""
        if isinstance(message, Pose):
            self._cameras.receive(key, message, now)
            if message.position[2] > self._highest and key not in self._walking:
                self._cameras.took_off(message.stamp)
                self._highest = inf

    def due(self, key: Key) -> bool:
        """Return whether all airframes have reported."""
        return self._cameras.complete()

    def step(self, now: int) -> tuple[()]:
        """Send the frames that are due."""
        for frame in self._cameras.take(now):
            self._frames += 1
            sent = TrackerFrame(self._frames, frame.captured - self._epoch, now - self._epoch, self._all(frame))
            for arriving in self._disturbances.apply(sent):
                if self.deliver is not None:
                    self.deliver(arriving)
        return ()

    def report(self, now: int) -> Report:
        """Return how many frames were sent."""
        if not self._frames:
            return Report(Phase.WAITING, self._cameras.state(now).trouble)
        return Report(Phase.SERVING, self.swarm.gateway.source)

    def _all(self, frame: TrackerFrame) -> tuple[ReportedBody, ...]:
        """Return all bodies of the tracker in its own axes, also those that are not seen."""
        seen = {body.identity: self._named(self._coordinates.to_tracker(body)) for body in frame.bodies}
        self._bodies |= {identity: body._replace(tracked=False, position=LOST) for identity, body in seen.items()}
        return tuple(seen.get(identity, lost) for identity, lost in self._bodies.items())

    def _unseen(self, drone: int) -> ReportedBody:
        body = self.swarm.body(drone)
        number, name = (drone, body) if isinstance(body, str) else (body, None)
        return unseen(number, name)

    def _named(self, body: ReportedBody) -> ReportedBody:
        return body._replace(name=self._renamed.get(body.name or "", body.name))


class Disturbances:
    """Loses, repeats and reorders the shares of `amounts` of frames; one seed disturbs one stream in one way."""

    def __init__(self, amounts: Twin, chance: Randomness) -> None:
        self._amounts, self._chance = amounts, chance
        self._held: TrackerFrame | None = None

    def apply(self, frame: TrackerFrame) -> tuple[TrackerFrame, ...]:
        """Return the frames that arrive when `frame` is sent: none, it, it twice, or it and the one before."""
        amounts, held = self._amounts, self._held
        self._held = None
        arriving: tuple[TrackerFrame, ...] = (frame,)
        if self._happens(amounts.loss):
            arriving = ()
        elif self._happens(amounts.repetition):
            arriving = (frame, frame)
        elif held is None and self._happens(amounts.reordering):
            self._held, arriving = frame, ()
        return arriving if held is None else (*arriving, held)

    def _happens(self, share: float) -> bool:
        return share > 0.0 and self._chance.random() < share
