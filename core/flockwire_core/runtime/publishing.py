"""Publishes messages: encodes each once, numbers it, and collects those that the recorder receives in batches."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING

from flockwire_core import clock
from flockwire_core.wire.batch import BatchBuilder, Entry
from flockwire_core.wire.codec import CODECS
from flockwire_core.wire.inbox import ATTACHMENT, publisher_of
from flockwire_core.wire.keys import BATCH, ROWS, Key
from flockwire_core.wire.plan import Plan

if TYPE_CHECKING:
    import zenoh

    from flockwire_core.wire.codec import Message


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
