"""The simulated tracking system: truth in, measured positions out, with noise, drop-outs and latency."""

from __future__ import annotations

from math import hypot
from typing import NamedTuple

from flockwire_core.domain.pose import LEVEL, Pose
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import Vector
from flockwire_core.process.cores import Start
from flockwire_core.swarm.model import uav
from flockwire_core.wire.codec import Message
from flockwire_core.wire.keys import Key
from flockwire_mocap.completeness import Completeness
from flockwire_mocap.tracking import ReportedBody, SourceState, TrackerFrame, noisy


class CameraConditions(NamedTuple):
    """What the cameras see besides the swarm file's noise and drop-outs.

    `noises` are m, standard deviations per axis; `visitors` names and places (m, world frame) of bodies that are no
    drones. The drones of each of `swaps` have each other's names, one pair after the other.
    """

    noises: tuple[float, ...] = ()
    unseen: frozenset[int] = frozenset()
    swaps: tuple[tuple[int, int], ...] = ()
    visitors: tuple[tuple[str, Vector], ...] = ()


class SimulatedSource:
    """Measures the simulated airframes of the swarm under `conditions`, which may change.

    A body is available at the first `take` at least the latency (s) after its stamp, so latency is a multiple of the
    frames. `called` is number and name of each drone's body.
    """

    def __init__(self, start: Start) -> None:
        swarm = start.plan.swarm
        parameters = swarm.gateway
        self._drones = {Key("truth", uav(i)): i for i in swarm.tracked}
        self.triggers = frozenset(self._drones)
        bodies = [(i, swarm.body(i)) for i in swarm.tracked]
        self.called: dict[int, tuple[int, str | None]] = {
            i: (i, body) if isinstance(body, str) else (body, None) for i, body in bodies
        }
        self._frames = 0
        self._noise, self._dropout = parameters.noise, parameters.dropout
        self._latency = round(parameters.latency * SECOND)
        self._randomness = start.chance
        self.conditions = CameraConditions()
        self._visitors: dict[str, int] = {}  # numbers of the bodies that are not drones
        self._completeness = Completeness(swarm.tracked, 1.0 / parameters.rate_hz)
        self._complete = False
        self._truths: dict[int, Pose] = {}  # the newest, of those not measured yet
        self._order = swarm.tracked[-1:] + swarm.tracked[:-1]  # of random draws: another changes every seed's flight
        self._measured: dict[int, list[ReportedBody]] = {}  # by stamp, Unix ns

    def receive(self, key: Key, message: Message, now: int) -> None:
        """Receive a truth."""
        if isinstance(message, Pose):
            drone = self._drones[key]
            self._truths[drone] = message
            self._complete = self._completeness.report(drone, now)

    def announce(self, body: str) -> None:
        """Give a number to a body that is not a drone, and that may appear."""
        # the number of the first body that is not a drone
        self._visitors.setdefault(body, 10_000 + len(self._visitors))

    @property
    def visitors(self) -> tuple[tuple[int, str], ...]:
        """Number and name of the bodies that are not drones."""
        return tuple((number, name) for name, number in self._visitors.items())

    def complete(self) -> bool:
        """Return whether the truth that was just received completed a frame."""
        return self._complete

    def take(self, now: int) -> list[TrackerFrame]:
        """Measure the truths received since the last call; return the measurements available by `now` (Unix ns)."""
        truths, self._truths = self._truths, {}
        for drone in self._order:
            if drone in truths:
                self._measure(drone, truths[drone])
        if truths and self.conditions.visitors:
            stamp = max(truth.stamp for truth in truths.values())
            for name, place in self.conditions.visitors:
                seen = noisy(place, self._noise, self._randomness)
                self._measured.setdefault(stamp, []).append(
                    ReportedBody(self._visitors[name], name, seen, LEVEL, tracked=True)
                )
        due, frames = now - self._latency, list[TrackerFrame]()
        for stamp in sorted([stamp for stamp in self._measured if stamp <= due]):
            bodies = tuple(self._measured.pop(stamp))
            frames.append(TrackerFrame(self._frames, stamp, now, bodies, False))
            self._frames += 1
        return frames

    def state(self, now: int) -> SourceState:
        """Return the missing input if there are no frames."""
        return SourceState("waits for the kinematics' truth")

    def _measure(self, drone: int, truth: Pose) -> None:
        if self._dropout and self._randomness.random() < self._dropout:
            return
        conditions = self.conditions
        if drone in conditions.unseen:
            return
        stamp, position, called, noise = truth.stamp, truth.position, drone, self._noise
        for more in conditions.noises:
            noise = hypot(noise, more)
        for pair in conditions.swaps:
            called = sum(pair) - called if called in pair else called
        if noise:
            position = noisy(position, noise, self._randomness)
        number, name = self.called[called]
        self._measured.setdefault(stamp, []).append(
            ReportedBody(number, name, position, truth.orientation, tracked=True)
        )
