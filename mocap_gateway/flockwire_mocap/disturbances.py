"""Faults between cameras and gateway, applied to frames: noise, occlusion, loss, repetition, reordering."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import Protocol

from flockwire.domain.time import SECOND

from flockwire_mocap.tracking import ReportedBody, TrackerFrame


class Chance(Protocol):
    """A source of random numbers: a seeded random.Random."""

    def gauss(self, mu: float, sigma: float) -> float:
        """Return a normally distributed number."""

    def random(self) -> float:
        """Return a number evenly distributed over [0, 1)."""


@dataclass(frozen=True, slots=True)
class Occlusion:
    """The body `identity` is not seen for `duration` s, from `begin` s after the first frame's capture on."""

    identity: int
    begin: float
    duration: float


@dataclass(frozen=True, slots=True)
class Disturbance:
    """The strength of the faults.

    Attributes:
        noise: standard deviation on each axis, in the unit of the frames' positions. loss: share of frames that never
        arrive. repetition: share of frames that arrive twice. reordering: share of frames that arrive after the next
        one.
        flicker: share of a body's frames in which it is not seen.
        occlusions: times in which a body is not seen.

    """

    noise: float = 0.0
    loss: float = 0.0
    repetition: float = 0.0
    reordering: float = 0.0
    flicker: float = 0.0
    occlusions: Collection[Occlusion] = ()


class Disturbances:
    """Applies a `Disturbance` to frames, one after the other; the same seed disturbs the same frames equally."""

    def __init__(self, disturbance: Disturbance, chance: Chance) -> None:
        self._disturbance, self._chance = disturbance, chance
        self._first: int | None = None
        self._held: TrackerFrame | None = None

    def apply(self, frame: TrackerFrame) -> tuple[TrackerFrame, ...]:
        """Return the frames that arrive when `frame` is sent: none, it, it twice, or it and the one before."""
        if self._first is None:
            self._first = frame.captured
        amounts, held = self._disturbance, self._held
        self._held = None
        disturbed = self._disturbed(frame)
        arriving: tuple[TrackerFrame, ...] = (disturbed,)
        if self._happens(amounts.loss):
            arriving = ()
        elif self._happens(amounts.repetition):
            arriving = (disturbed, disturbed)
        elif held is None and self._happens(amounts.reordering):
            self._held, arriving = disturbed, ()
        return arriving if held is None else (*arriving, held)

    def _happens(self, share: float) -> bool:
        return share > 0.0 and self._chance.random() < share

    def _disturbed(self, frame: TrackerFrame) -> TrackerFrame:
        elapsed = (frame.captured - (self._first or 0)) / SECOND
        hidden = {
            occlusion.identity
            for occlusion in self._disturbance.occlusions
            if 0.0 <= elapsed - occlusion.begin < occlusion.duration
        }
        return frame._replace(bodies=tuple(self._seen(body, body.identity in hidden) for body in frame.bodies))

    def _seen(self, body: ReportedBody, hidden: bool) -> ReportedBody:
        if hidden or self._happens(self._disturbance.flicker):
            return body._replace(tracked=False)
        noise, draw = self._disturbance.noise, self._chance
        if not noise:
            return body
        x, y, z = body.position
        return body._replace(
            position=(x + draw.gauss(0.0, noise), y + draw.gauss(0.0, noise), z + draw.gauss(0.0, noise))
        )
