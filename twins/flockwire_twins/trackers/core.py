"""The simulated tracker without sockets: truth in, frames of a real tracker out.

Cameras, noise, latency and drop-outs are those of the simulated source; lost and repeated frames are added.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

from flockwire_core.domain.time import SECOND
from flockwire_core.process.cores import Ground, Randomness, Start
from flockwire_core.swarm.gateway import Twin
from flockwire_core.wire.codec import Message
from flockwire_core.wire.keys import Key
from flockwire_core.wire.phase import Phase
from flockwire_core.wire.status import Report
from flockwire_mocap.coordinates import coordinates_of
from flockwire_mocap.tracking import LOST, ReportedBody, TrackerFrame, unseen

from flockwire_twins.trackers.cameras import SimulatedSource

Deliver = Callable[[TrackerFrame], None]


class TwinCore(Ground):
    """Tracks the simulated airframes of a swarm; calls what it serves with each frame at its send time."""

    def __init__(self, start: Start) -> None:
        self.swarm = swarm = start.plan.swarm
        self._deliver: Deliver | None = None
        gateway = swarm.gateway
        table = gateway.twin
        assert table is not None  # noqa: S101  (without one the swarm has no such process)
        self.source = SimulatedSource(start)
        self.triggers = self.source.triggers
        self.period = 1.0 / gateway.rate_hz
        self._disturbances = Disturbances(table, start.chance)
        self._coordinates = coordinates_of(gateway)
        self._renamed = table.renamed
        # ns of the tracker's clock at the start of the process: it differs from the swarm's
        self._epoch = start.now - 1000 * SECOND
        self._frames = 0

    def serve(self, deliver: Deliver | None) -> None:
        """Call `deliver` with each frame from now on; None: nothing."""
        self._deliver = deliver

    @property
    def names(self) -> dict[int, str]:
        """The tracker's names for bodies, by number."""
        return {identity: body.name or f"body {identity}" for identity, body in self._bodies.items()}

    def receive(self, key: Key, message: Message, now: int) -> None:
        """Receive an airframe's truth."""
        self.source.receive(key, message, now)

    def due(self, key: Key) -> bool:
        """Return whether all airframes have reported."""
        return self.source.complete()

    def step(self, now: int) -> tuple[()]:
        """Send the frames that are due."""
        for frame in self.source.take(now):
            self._frames += 1
            sent = TrackerFrame(self._frames, frame.captured - self._epoch, now - self._epoch, self._all(frame))
            for arriving in self._disturbances.apply(sent):
                if self._deliver is not None:
                    self._deliver(arriving)
        return ()

    def report(self, now: int) -> Report:
        """Return how many frames were sent."""
        if not self._frames:
            return Report(Phase.WAITING, self.source.state(now).trouble)
        return Report(Phase.SERVING, self.swarm.gateway.source)

    def _all(self, frame: TrackerFrame) -> tuple[ReportedBody, ...]:
        """Return all bodies of the tracker in its own axes, also those that are not seen."""
        seen = {body.identity: self._named(self._coordinates.to_tracker(body)) for body in frame.bodies}
        self._bodies.update({identity: body._replace(tracked=False, position=LOST) for identity, body in seen.items()})
        return tuple(seen.get(identity, lost) for identity, lost in self._bodies.items())

    @cached_property
    def _bodies(self) -> dict[int, ReportedBody]:
        """All bodies as they were reported last, unseen ones too, by number."""
        numbered = (*self.source.called.values(), *self.source.visitors)
        return {number: self._named(unseen(number, name)) for number, name in numbered}

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
