"""Samples of keys on Zenoh: published, and received.

A message is encoded once, numbered, and collected for the recorder, which receives some in batches. Of a received key
the newest sample is read by a step or announced; all older ones are checked and counted too.
"""

from __future__ import annotations

import asyncio
import ctypes
import threading
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Final

import zenoh

from flockwire_core import clock
from flockwire_core.wire.batch import BatchBuilder, Entry
from flockwire_core.wire.codec import CODECS
from flockwire_core.wire.inbox import ATTACHMENT, Inbox, Input, publisher_of
from flockwire_core.wire.keys import BATCH, ROWS, Key
from flockwire_core.wire.plan import Plan

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


class _Outlet:
    """One published key: its Zenoh publishers, the publisher's id, and its key in batches, empty if it is in none."""

    def __init__(self, key: Key, publishers: tuple[zenoh.Publisher, ...], identity: bytes, batched: bool) -> None:
        self.encode = CODECS[ROWS[key.kind].message].encode
        self.publishers, self.identity = publishers, identity
        self.batched_key = f"{key.owner}/{key.kind}" if batched else ""
        self.sequence = 0


class Publishing:
    """Publishes on the keys of the process `identity`; `declare` returns the Zenoh publishers of one of them.

    `session` are 16 bytes that identify its session.
    """

    def __init__(
        self, plan: Plan, identity: str, session: bytes, declare: Callable[[Key], tuple[zenoh.Publisher, ...]]
    ) -> None:
        self.outlets = {
            key: _Outlet(
                key, declare(key) if plan.subscribers(key) else (), publisher_of(session, key), key in plan.batched
            )
            for key in plan.publishes[identity]
        }
        self._batch, self._batch_key = BatchBuilder(plan.swarm.frame), Key(BATCH, identity)

    def publish(self, messages: Iterable[tuple[Key, Message]]) -> None:
        """Publish messages; KeyError if the key table does not allow this identity to publish one of the keys."""
        for key, message in messages:
            outlet = self.outlets[key]
            self._put(outlet, outlet.encode(message), clock.now())
        if self._batch.is_due(clock.now()):
            self.flush()

    def flush(self) -> None:
        """Send the batch for the recorder."""
        now = clock.now()
        batch = self._batch.take(now)
        if batch.entries:
            outlet = self.outlets[self._batch_key]
            self._put(outlet, outlet.encode(batch), now)

    def _put(self, outlet: _Outlet, payload: bytes, now: int) -> None:
        sequence = outlet.sequence
        outlet.sequence = sequence + 1
        if outlet.publishers:
            attached = ATTACHMENT.pack(sequence, now, 16, outlet.identity)
            for publisher in outlet.publishers:
                publisher.put(payload, attachment=attached)
        if outlet.batched_key and self._batch.add(Entry(outlet.batched_key, sequence, now, payload)):
            self.flush()
