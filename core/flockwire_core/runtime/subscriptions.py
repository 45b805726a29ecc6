"""The newest sample of a key, read by a step or announced; all older ones are checked and counted too."""

from __future__ import annotations

import asyncio
import ctypes
import threading
from collections import deque
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Final

import zenoh

from flockwire_core import clock
from flockwire_core.wire.inbox import Inbox, Input

if TYPE_CHECKING:
    from flockwire_core.wire.codec import Message

BACKLOG: Final = 256  # samples of one key that are buffered; beyond, the oldest is dropped and counted as an overflow
_thread: Final = threading.local()
BEHIND: Final = 1_000_000  # ns since a key was handled within which its next sample has waited: this process is behind


class Rings:
    """The received samples of one key, buffered by Zenoh: a ring for each session that carries the key."""

    def __init__(self, rings: Sequence[zenoh.Subscriber[zenoh.handlers.Handler[zenoh.Sample]]]) -> None:
        self._rings = rings

    def try_recv(self) -> zenoh.Sample | None:
        """Return a received sample, None if there is none."""
        for ring in self._rings:
            sample = ring.try_recv()
            if sample is not None:
                return sample
        return None


class Buffered(Input):
    """The samples of a key, buffered until they are read; more than BACKLOG between two reads count as overflow."""

    def __init__(self, inbox: Inbox, rings: Rings) -> None:
        super().__init__(inbox)
        self._rings = rings

    def messages(self, now: int) -> list[Message]:
        """Return the messages that came since the last call and were accepted."""
        found: list[Message] = []
        count = 0
        while (sample := self._rings.try_recv()) is not None:
            payload, attached = _bytes(sample)
            message = self.inbox.accept(payload, attached, now)
            count += 1
            if message is not None:
                found.append(message)
        if count >= BACKLOG:
            self.inbox.rejected["overflow"] += 1
        return found

    def message(self, now: int) -> Message | None:
        """Return the newest message that came since the last call and was accepted, None when there is none."""
        found = self.messages(now)
        return found[-1] if found else None


class Prompt(Input):
    """The newest sample of a key (or each, if every message counts), announced to `wakeup` at arrival."""

    def __init__(self, inbox: Inbox, wakeup: Wakeup) -> None:
        super().__init__(inbox)
        self.handled = 0  # when Zenoh's thread was done with its last sample, monotonic ns
        self._wakeup = wakeup
        self._waiting: deque[zenoh.Sample] = deque(maxlen=BACKLOG)
        self._announced = False

    def arrived(self, sample: zenoh.Sample) -> None:
        """Buffer the sample and announce it. Called by Zenoh, in its thread."""
        _keep_thread_state()
        self._waiting.append(sample)
        if self.inbox.keep_all or not self._announced:
            self._announced = True
            self._wakeup.announce(self)

    def message(self, now: int) -> Message | None:
        """Return the newest message that came since the last call and was accepted, None when there is none."""
        self._announced = False
        newest, count = None, len(self._waiting)
        if count >= BACKLOG:
            self.inbox.rejected["overflow"] += 1
        for _ in range(min(count, 1) if self.inbox.keep_all else count):
            payload, attached = _bytes(self._waiting.popleft())
            newest = self.inbox.accept(payload, attached, now) or newest
        return newest


class Wakeup:
    """Calls `handle` for each key that arrives, with `lock` held: in the loop, or when `direct` on Zenoh's thread.

    Direct mode takes 18 % of an agent's CPU away: nothing else has to wake, and what `handle` publishes leaves when it
    returns. Zenoh's thread hands over to the loop if the lock is taken, because it must never wait, or if the process
    is behind: then it goes on receiving, and the newest message counts.
    """

    def __init__(self, handle: Callable[[Prompt], None], lock: threading.Lock) -> None:
        self.direct = False
        self._handle, self._lock = handle, lock
        self._loop = asyncio.get_running_loop()
        self._ready: deque[Prompt] = deque()
        self._called = False

    def announce(self, prompt: Prompt) -> None:
        """Have `handle` called with `prompt`. Called by Zenoh, in its thread."""
        if self.direct and clock.monotonic() - prompt.handled > BEHIND and self._lock.acquire(blocking=False):
            try:
                self._handle(prompt)
            except Exception as error:  # the loop reports it, as any other
                call_soon(self._loop, _raise, error)
            finally:
                self._lock.release()
                prompt.handled = clock.monotonic()
            return
        self._ready.append(prompt)
        if not self._called:
            self._called = True
            call_soon(self._loop, self._wake)

    def _wake(self) -> None:
        self._called = False
        while self._ready:
            prompt = self._ready.popleft()
            try:
                with self._lock:
                    self._handle(prompt)
            except Exception as error:  # the keys behind it are handled all the same
                call_soon(self._loop, _raise, error)


def call_soon(loop: asyncio.AbstractEventLoop, function: Callable[..., None], *arguments: object) -> None:
    """Call `function` in `loop`, from another thread."""
    try:
        loop.call_soon_threadsafe(function, *arguments)
    except RuntimeError:  # the loop is closed: the process is ending
        return


def _raise(error: Exception) -> None:
    raise error


def _keep_thread_state() -> None:
    """Keep what Python has of this thread, one of Zenoh's: else each callback maps it, and unmaps it at its end.

    This takes 30 % of an agent's CPU away (3.34 to 2.35 %, measured without the watchdog's ticks).
    """
    if not hasattr(_thread, "kept"):
        _thread.kept = ctypes.pythonapi.PyGILState_Ensure()


def _bytes(sample: zenoh.Sample) -> tuple[bytes, bytes]:
    attached = sample.attachment
    return sample.payload.to_bytes(), attached.to_bytes() if attached is not None else b""
