"""The simulated tracking system: truth in, measured positions out, with noise, drop-outs, latency and faults."""

from __future__ import annotations

from math import hypot

from flockwire_core.domain.order import Mission
from flockwire_core.domain.pose import Pose
from flockwire_core.domain.quaternion import IDENTITY
from flockwire_core.domain.time import SECOND
from flockwire_core.domain.vector import Vector, add, scale
from flockwire_core.process.cores import Start
from flockwire_core.process.faults import FalsePose, NameSwap, NoiseBurst, TrackerLoss, Visitor
from flockwire_core.swarm.model import uav
from flockwire_core.wire.codec import Message
from flockwire_core.wire.keys import Key

from flockwire_mocap.completeness import Completeness
from flockwire_mocap.tracking import ReportedBody, SourceState, TrackerFrame

CameraFault = FalsePose | TrackerLoss | NoiseBurst | NameSwap | Visitor
VISITORS = 10_000  # the number of the first body that is not a drone


class SimulatedSource:
    """Measures the simulated airframes of the swarm, with the tracker's faults.

    A body is available at the first `take` at least the latency (s) after its stamp, so latency is a multiple of the
    frames. Faults count from `start.took_off` (Unix ns), or without it from the order to take off.
    """

    def __init__(self, start: Start) -> None:
        swarm = start.plan.swarm
        parameters = swarm.gateway
        self._drones = {Key("truth", uav(i)): i for i in swarm.tracked}
        self.triggers = frozenset(self._drones)
        self._names = {i: swarm.body(i) for i in swarm.tracked}
        self._frames = 0
        self._noise, self._dropout = parameters.noise, parameters.dropout
        self._latency = round(parameters.latency * SECOND)
        self._randomness = start.chance
        self._faults = tuple(fault for fault in start.faults if isinstance(fault, CameraFault))
        visitors = dict.fromkeys(fault.body for fault in self._faults if isinstance(fault, Visitor))
        self._visitors = {body: VISITORS + k for k, body in enumerate(visitors)}
        self._took_off = start.took_off
        self._completeness = Completeness(swarm.tracked, 1.0 / parameters.rate_hz)
        self._complete = False
        self._truths: dict[int, Pose] = {}  # the newest, of those not measured yet
        self._order = swarm.tracked[-1:] + swarm.tracked[:-1]  # of random draws: another changes every seed's flight
        self._measured: dict[int, list[ReportedBody]] = {}  # by stamp, Unix ns

    def receive(self, key: Key, message: Message, now: int) -> None:
        """Receive a truth, or the order to take off."""
        match message:
            case Pose():
                drone = self._drones[key]
                self._truths[drone] = message
                self._complete = self._completeness.report(drone, now)
            case Mission() if message.verb == "takeoff":
                self.took_off(message.stamp)

    def took_off(self, stamp: int) -> None:
        """Count faults from `stamp` (Unix ns), unless they count already."""
        self._took_off = self._took_off or stamp

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
        if truths and self._visitors:
            self._measure_visitors(max(truth.stamp for truth in truths.values()))
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
        stamp, position, noise, called = truth.stamp, truth.position, self._noise, drone
        for fault in self._active_faults(stamp) if self._faults else []:
            if isinstance(fault, NoiseBurst):
                noise = hypot(noise, fault.noise)
            elif isinstance(fault, NameSwap):
                called = sum(fault.drones) - called if called in fault.drones else called
            elif isinstance(fault, TrackerLoss) and fault.drone == drone:
                return
            elif isinstance(fault, FalsePose) and fault.drone == drone:
                since = (stamp - (self._took_off or 0)) / SECOND - fault.at
                position = add(position, scale(fault.velocity, since))
        if noise:
            position = self._noisy(position, noise)
        name = self._names[called]
        number, text = (called, name) if isinstance(name, str) else (name, None)
        self._add(stamp, ReportedBody(number, text, position, truth.orientation, tracked=True))

    def _measure_visitors(self, stamp: int) -> None:
        for fault in self._active_faults(stamp):
            if isinstance(fault, Visitor):
                t = (stamp - (self._took_off or 0)) / SECOND - fault.at
                place = self._noisy(add(fault.start, scale(fault.velocity, t)), self._noise)
                self._add(stamp, ReportedBody(self._visitors[fault.body], fault.body, place, IDENTITY, tracked=True))

    def _add(self, stamp: int, body: ReportedBody) -> None:
        at = self._measured.get(stamp)
        if at is None:
            self._measured[stamp] = [body]
        else:
            at.append(body)

    def _active_faults(self, stamp: int) -> list[CameraFault]:
        if self._took_off is None:
            return []
        t = (stamp - self._took_off) / SECOND
        return [fault for fault in self._faults if 0.0 <= t - fault.at < fault.duration]

    def _noisy(self, position: Vector, noise: float) -> Vector:
        x, y, z = position
        gauss = self._randomness.gauss
        return (x + gauss(0.0, noise), y + gauss(0.0, noise), z + gauss(0.0, noise))
