"""What a law costs: its messages and their bytes, paths and effort, beside the figures of a study."""

from __future__ import annotations

from typing import NamedTuple

from flockwire_analysis.expenditure import effort, path_length
from flockwire_analysis.recorded import Trace

from flockwire_lab.process import Published, Tap

EXCHANGED = frozenset({"estimate", "law", "bids"})  # kinds of keys by which a law speaks to its neighbours


class Cost(NamedTuple):
    """A figure of a law: its key in a result, its heading, its unit."""

    key: str
    heading: str
    unit: str


COSTS = (
    Cost("path_m", "path", "m"),
    Cost("messages_per_s", "messages", "1/s"),
    Cost("bytes_per_s", "data", "B/s"),
    Cost("effort_m2_s", "effort", "m²/s"),
)


class Traffic:
    """Counts what drones publish for each other by their law, and passes all on to `tap`."""

    def __init__(self, tap: Tap) -> None:
        self._tap, self._messages, self._bytes = tap, 0, 0

    def take(self, published: Published) -> None:
        """Receive a published message."""
        if published.key.kind in EXCHANGED:
            self._messages += 1
            self._bytes += len(published.sample.payload)
        self._tap(published)

    def costs(self, trace: Trace, seconds: float) -> dict[str, float | None]:
        """Return the figures of COSTS for a flight of `seconds`, per follower."""
        share = 1.0 / (seconds * len(trace.swarm.followers))
        return {
            "path_m": path_length(trace),
            "messages_per_s": self._messages * share,
            "bytes_per_s": self._bytes * share,
            "effort_m2_s": effort(trace),
        }
