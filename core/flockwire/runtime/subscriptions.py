"""The newest sample of a key, read by a step or announced; all older ones are checked and counted too."""

from __future__ import annotations

import asyncio
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Protocol

import zenoh

from flockwire.wire.inbox import Inbox, Received

if TYPE_CHECKING:
    from flockwire.wire.codec import Message

BACKLOG = 256  # samples of one key that are buffered; beyond, the oldest is dropped and counted as an overflow


class Ring(Protocol):
    """Buffered samples of one key: a Zenoh subscriber's, or `Rings`."""

    def try_recv(self) -> zenoh.Sample | None:
        """Return the oldest received sample, None if there is none."""


class Rings:
    """The samples of one key from several sessions."""

    def __init__(self, rings: Sequence[Ring]) -> None:
        self._rings = rings

    def try_recv(self) -> zenoh.Sample | None:
        """Return a received sample, None if there is none."""
        for ring in self._rings:
            sample = ring.try_recv()
            if sample is not None:
                return sample
        return None


class Subscription(ABC):
    """The newest sample of the key of `inbox`."""

    def __init__(self, inbox: Inbox) -> None:
        self.inbox = inbox

    @abstractmethod
    def take(self, now: int) -> Received | None:
        """Return the newest message that came since the last call and was accepted, None when there is none."""

    def message(self, now: int) -> Message | None:
        """Return only the message of `take`."""
        received = self.take(now)
        return None if received is None else received.message

    def _count(self, samples: int) -> None:
        if samples >= BACKLOG:
            self.inbox.rejected["overflow"] += 1


class Newest(Subscription):
    """The newest sample of a key, buffered until a step reads it."""

    def __init__(self, inbox: Inbox, ring: Ring) -> None:
        super().__init__(inbox)
        self._ring = ring

    def take(self, now: int) -> Received | None:
        """Return the newest message that came since the last call and was accepted, None when there is none."""
        newest, count = None, 0
        while (sample := self._ring.try_recv()) is not None:
            newest, count = self.inbox.accept(*_bytes(sample), now) or newest, count + 1
        self._count(count)
        return newest


class Prompt(Subscription):
    """The newest sample of a key (or each, if every message counts), announced to `wakeup` at arrival."""

    def __init__(self, inbox: Inbox, wakeup: Wakeup) -> None:
        super().__init__(inbox)
        self._wakeup = wakeup
        self._waiting: deque[zenoh.Sample] = deque(maxlen=BACKLOG)
        self._announced = False

    def arrived(self, sample: zenoh.Sample) -> None:
        """Buffer the sample and wake the loop. Called by Zenoh, in its thread."""
        self._waiting.append(sample)
        if self.inbox.each or not self._announced:
            self._announced = True
            self._wakeup.announce(self)

    def take(self, now: int) -> Received | None:
        """Return the newest message that came since the last call and was accepted, None when there is none."""
        self._announced = False
        newest, count = None, len(self._waiting)
        self._count(count)
        for _ in range(min(count, 1) if self.inbox.each else count):
            newest = self.inbox.accept(*_bytes(self._waiting.popleft()), now) or newest
        return newest


class Wakeup:
    """Wakes the running loop once for all pending samples, and calls `handle` for each key in order."""

    def __init__(self, handle: Callable[[Prompt], None]) -> None:
        self._handle = handle
        self._loop = asyncio.get_running_loop()
        self._ready: deque[Prompt] = deque()
        self._called = False

    def announce(self, prompt: Prompt) -> None:
        """Schedule `handle` with `prompt` in the loop. Called by Zenoh, in its thread."""
        self._ready.append(prompt)
        if not self._called:
            self._called = True
            try:
                self._loop.call_soon_threadsafe(self._wake)
            except RuntimeError:  # the loop is closed: the process is ending
                return

    def _wake(self) -> None:
        self._called = False
        while self._ready:
            self._handle(self._ready.popleft())


def _bytes(sample: zenoh.Sample) -> tuple[bytes, bytes]:
    attached = sample.attachment
    return sample.payload.to_bytes(), attached.to_bytes() if attached is not None else b""
