"""Faults between cameras and gateway, applied to frames: loss, repetition, reordering."""

from __future__ import annotations

from flockwire.process.cores import Randomness
from flockwire.swarm.gateway import Twin

from flockwire_mocap.tracking import TrackerFrame


class Disturbances:
    """Applies the shares of `amounts` to frames, in their order; one seed disturbs one stream in one way."""

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
