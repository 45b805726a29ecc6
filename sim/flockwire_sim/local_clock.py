"""The clock of one process: off by an offset, drifting, and stepped when it is set."""

from __future__ import annotations

from flockwire.domain.time import SECOND


class LocalClock:
    """Shows local = true + offset + correction + drift (true - epoch), in ns; `drift` is in ns per s."""

    def __init__(self, epoch: int, offset: int = 0, drift: int = 0) -> None:
        self._epoch, self._offset, self._drift = epoch, offset, drift
        self._correction = 0

    def read(self, true: int) -> int:
        """Return what it shows at the time `true` (Unix ns)."""
        drift = self._drift
        return true + self._offset + self._correction + (drift * (true - self._epoch) // SECOND if drift else 0)

    def correct(self, correction: int) -> None:
        """Add `correction` ns to what it would show: how far it is behind the swarm's."""
        self._correction = correction

    def step(self, by: int) -> None:
        """Set it forward by `by` ns (back when negative)."""
        self._offset += by

    def true_length(self, local: int) -> int:
        """Return how long, in true ns, `local` ns last on it."""
        return local * SECOND // (SECOND + self._drift)
