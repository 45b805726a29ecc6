"""Publications that wait: after a pause of the process they leave in portions, which every router's queue takes."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable

from flockwire_operator.ros.mirror import Publication

PORTION = 49152  # bytes that leave at once: Zenoh's routers drop what exceeds two batches of 64 KiB
OVERHEAD = 128  # bytes of a message besides its payload: key, attachment, time
MOST_WAITING = 8192  # publications; beyond, the oldest are dropped


class Outgoing:
    """A bounded queue of publications; `dropped` counts those that were too many."""

    def __init__(self) -> None:
        self.dropped = 0
        self._waiting: deque[Publication] = deque()

    def add(self, publications: Iterable[Publication]) -> None:
        """Append publications; drop the oldest of too many."""
        self._waiting.extend(publications)
        while len(self._waiting) > MOST_WAITING:
            self._waiting.popleft()
            self.dropped += 1

    def take(self) -> list[Publication]:
        """Return the next portion, the oldest first."""
        found, size = list[Publication](), 0
        while self._waiting and size < PORTION:
            publication = self._waiting.popleft()
            size += len(publication[1]) + OVERHEAD
            found.append(publication)
        return found

    def __len__(self) -> int:
        return len(self._waiting)
