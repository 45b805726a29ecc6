"""One direction of a link, and the bytes of one connection in that direction: held, delayed, passed on in order.

Time is an argument: `now`, s of a clock that does not go back.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from random import Random

from flockwire_lab.network import Conditions, DirectedLink

MOST_HELD = 262_144  # bytes of one connection and direction; beyond, reading stops and TCP makes the sender wait
END = b""  # stands for the end of a connection's bytes


class Direction(DirectedLink):
    """One direction of a link; calls `changed` whenever a fault begins or ends."""

    def __init__(self, name: str, changed: Callable[[], None]) -> None:
        super().__init__(Conditions())
        self._random = Random(name)  # noqa: S311  (not for secrets)
        self._changed = changed

    def _update(self) -> None:
        super()._update()
        self._changed()

    def arrival(self, now: float, last: float) -> float:
        """Return the arrival of bytes sent at `now`: not before `last`, that of earlier bytes."""
        present = self.conditions
        return max(now + present.delay + present.jitter * self._random.random(), last)


class Stream:
    """The held bytes of one connection in one direction."""

    def __init__(self, direction: Direction) -> None:
        self._direction = direction
        self.size = 0  # bytes
        self._held: deque[tuple[float, bytes]] = deque()  # with the time of arrival
        self._last = 0.0

    @property
    def full(self) -> bool:
        """Whether no more bytes should be read now."""
        return self.size >= MOST_HELD

    def take(self, data: bytes, now: float) -> None:
        """Receive bytes that were received at `now`, or END."""
        self._last = self._direction.arrival(now, self._last)
        self._held.append((self._last, data))
        self.size += len(data)

    def due(self, now: float) -> list[bytes]:
        """Return and remove the bytes that arrive by `now`, in order."""
        arrived: list[bytes] = []
        while self._direction.passable and self._held and self._held[0][0] <= now:
            arrived.append(self._held.popleft()[1])
            self.size -= len(arrived[-1])
        return arrived

    def next_arrival(self) -> float | None:
        """Return the time of the next due bytes, None if unknown."""
        return self._held[0][0] if self._held and self._direction.passable else None
