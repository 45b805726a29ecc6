"""The simulated tracking system: truth in, measured positions out, with noise, drop-outs, latency and faults."""

from __future__ import annotations

from collections.abc import Iterable
from math import hypot

from flockwire.control.vector import Vector
from flockwire.flight.cores import Randomness, Start
from flockwire.flight.faults import Fault, NoiseBurst, TrackerLoss
from flockwire.nanoseconds import BILLION
from flockwire.swarm.model import Swarm, uav
from flockwire.wire.keys import Key
from flockwire.wire.messages import Message, Mission, Pose

from flockwire_mocap.completeness import Completeness
from flockwire_mocap.source import TrackedBody


class SimulatedSource:
    """Measures the simulated airframes of `swarm`, with the `faults` that are a tracker's.

    A body is available at the first `take` that is the latency (s) or more after its stamp, so latency comes in whole
    frames. Faults count from `took_off` (Unix ns), or without it from the order to take off.
    """

    def __init__(
        self, swarm: Swarm, randomness: Randomness, faults: Iterable[Fault] = (), took_off: int | None = None
    ) -> None:
        parameters = swarm.gateway
        self._drones = {Key("truth", uav(i)): i for i in swarm.flying}
        self.triggers = frozenset(self._drones)
        self.waits_for = "the kinematics' truth"
        self._noise, self._dropout = parameters.noise, parameters.dropout
        self._latency = round(parameters.latency * BILLION)
        self._randomness = randomness
        self._faults = tuple(fault for fault in faults if isinstance(fault, TrackerLoss | NoiseBurst))
        self._took_off = took_off
        self._completeness = Completeness(swarm.flying, 1.0 / parameters.rate_hz)
        self._complete = False
        self._truths: dict[int, Pose] = {}  # the newest, of those not measured yet
        self._order = swarm.flying[-1:] + swarm.flying[:-1]  # of random draws: another would change every seed's flight
        self._measured: list[TrackedBody] = []

    def receive(self, key: Key, message: Message, now: int) -> None:
        """Take in a truth, or the order to take off."""
        match message:
            case Pose():
                drone = self._drones[key]
                self._truths[drone] = message
                self._complete = self._completeness.report(drone, now)
            case Mission() if message.verb == "takeoff" and message.stamp > (self._took_off or 0):
                self._took_off = message.stamp

    def complete(self) -> bool:
        """Return whether the truth that was just received completed a frame."""
        return self._complete

    def take(self, now: int) -> list[TrackedBody]:
        """Measure what was received since the last call; return what is available by `now` (Unix ns)."""
        truths, self._truths = self._truths, {}
        for drone in self._order:
            if drone in truths:
                self._measure(drone, truths[drone])
        due = now - self._latency
        available = [body for body in self._measured if body.stamp <= due]
        self._measured = [body for body in self._measured if body.stamp > due]
        return available

    def _measure(self, drone: int, truth: Pose) -> None:
        """Measure the position of `drone`, or fail to."""
        if self._dropout and self._randomness.random() < self._dropout:
            return
        noise = self._noise
        for fault in self._active_faults(truth.stamp):
            if isinstance(fault, NoiseBurst):
                noise = hypot(noise, fault.noise)
            elif fault.drone == drone:
                return
        position = self._noisy(truth.position, noise) if noise else truth.position
        self._measured.append(TrackedBody(truth.stamp, drone, position, truth.orientation))

    def _active_faults(self, stamp: int) -> list[TrackerLoss | NoiseBurst]:
        if not self._faults or self._took_off is None:
            return []
        t = (stamp - self._took_off) / BILLION
        return [fault for fault in self._faults if 0.0 <= t - fault.at < fault.duration]

    def _noisy(self, position: Vector, noise: float) -> Vector:
        (x, y, z), gauss = position, self._randomness.gauss
        return (x + gauss(0.0, noise), y + gauss(0.0, noise), z + gauss(0.0, noise))


def make_source(start: Start) -> SimulatedSource:
    """Return the simulated source of the gateway that starts."""
    return SimulatedSource(start.plan.swarm, start.chance, start.faults, start.took_off)
