"""Simulated cameras: truth in, measured positions out, with noise, drop-outs and latency."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from math import hypot
from typing import Protocol

from flockwire.control.vector import Vector
from flockwire.flight.faults import Fault, NoiseBurst, TrackerLoss
from flockwire.nanoseconds import BILLION
from flockwire.swarm.tables import Gateway


class Randomness(Protocol):
    """Where noise comes from: a seeded random.Random."""

    def gauss(self, mu: float, sigma: float) -> float:
        """Return a normally distributed number."""

    def random(self) -> float:
        """Return a number evenly distributed over [0, 1)."""


class Cameras:
    """Measure positions as a motion capture system of the given parameters would.

    A frame leaves at the first exposure that is `latency` s or more after its own, so latency comes in whole frames.
    """

    def __init__(self, parameters: Gateway, randomness: Randomness, faults: Iterable[Fault] = ()) -> None:
        self._parameters, self._randomness = parameters, randomness
        self._faults = tuple(fault for fault in faults if isinstance(fault, TrackerLoss | NoiseBurst))
        self._begin: int | None = None  # of the time that faults count in
        self._under_way: deque[tuple[int, int, Vector]] = deque()  # stamp, drone, position

    def begin(self, stamp: int) -> None:
        """Count the time of faults from `stamp` (Unix ns), the order to take off."""
        self._begin = stamp

    def expose(self, stamp: int, drone: int, position: Vector) -> None:
        """See `drone` at `position` (m, world frame) at `stamp` (Unix ns), or fail to."""
        noise, draw = self._parameters.noise, self._randomness
        if self._parameters.dropout and draw.random() < self._parameters.dropout:
            return
        if self._faults and self._begin is not None:
            for fault in self._faults:
                if not 0.0 <= (stamp - self._begin) / BILLION - fault.at < fault.duration:
                    continue
                if isinstance(fault, NoiseBurst):
                    noise = hypot(noise, fault.noise)
                elif fault.drone == drone:
                    return
        if noise:
            x, y, z = position
            position = (x + draw.gauss(0.0, noise), y + draw.gauss(0.0, noise), z + draw.gauss(0.0, noise))
        self._under_way.append((stamp, drone, position))

    def frames(self, now: int) -> list[tuple[int, int, Vector]]:
        """Return (stamp, drone, measured position) of all that has arrived by `now` (Unix ns)."""
        arrived = []
        due = now - round(self._parameters.latency * BILLION)
        while self._under_way and self._under_way[0][0] <= due:
            arrived.append(self._under_way.popleft())
        return arrived
