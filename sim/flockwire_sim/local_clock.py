"""The clock of one process, with offset, drift and steps."""

from __future__ import annotations

from flockwire.domain.time import SECOND


class LocalClock:
    """Shows local = true + offset + correction + drift (true - epoch), in ns; `drift` is in ns per s."""

    def __init__(self, epoch: int, offset: int = 0, drift: int = 0) -> None:
        self._epoch, self._offset, self._drift = epoch, offset, drift
        self._correction = 0

    def read(self, true: int) -> int:
        """Return its time at the true time `true` (Unix ns)."""
        drift = self._drift
        return true + self._offset + self._correction + (drift * (true - self._epoch) // SECOND if drift else 0)

    def correct(self, correction: int) -> None:
        """Add `correction` ns, its lag behind the swarm's clock."""
        self._correction = correction

    def step(self, by: int) -> None:
        """Set it forward by `by` ns (back if negative)."""
        self._offset += by

    def true_length(self, local: int) -> int:
        """Return the true ns of `local` ns on it."""
        return local * SECOND // (SECOND + self._drift)
