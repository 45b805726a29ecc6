"""Keys as ROS 2 topics: every sample with its undecoded payload."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from operator import itemgetter

from flockwire_core.runtime.session import Session
from flockwire_core.wire.batch import Batch
from flockwire_core.wire.cdr import MessageError
from flockwire_core.wire.codec import decode
from flockwire_core.wire.inbox import BURST, CANARY, MISDIRECTED, OVER_QUOTA, Origin, Quota, mark_of, read_attachment
from flockwire_core.wire.keys import ROWS, Key
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.schemas import ROS_TYPES

BATCHES = 64  # of one process that are buffered between two reads, at most

Sample = tuple[int, str, bytes, int, bytes]  # source time (Unix ns), topic, publisher, sequence, payload (CDR)


class Topic:
    """One key: its ROS 2 topic `name`, the `ros_type` of its messages, and its samples.

    At most `capacity` samples are buffered between two reads. Samples over the quota, with an unknown attachment, of
    another key, or that find the buffer full are counted and dropped.
    """

    def __init__(self, plan: Plan, key: Key, session: Session, capacity: int = 2048) -> None:
        self._checked = _Checked(plan, key)
        self.name, self.ros_type = self._checked.name, ROS_TYPES[ROWS[key.kind].message]
        self._capacity = min(capacity, BURST * plan.rate(key))
        self._samples = session.every(key, self._capacity)
        self._mark = mark_of(key)

    def samples(self, now: int, rejected: Counter[str]) -> Iterator[Sample]:
        """Yield the samples received by `now` (Unix ns); count dropped ones in `rejected`, by key and reason."""
        for origin, payload in self._received(now, rejected):
            yield origin.sent, self.name, origin.publisher, origin.sequence, payload

    def _received(self, now: int, rejected: Counter[str]) -> Iterator[tuple[Origin, bytes]]:
        checked = self._checked
        for _ in range(self._capacity):
            sample = self._samples.try_recv()
            if sample is None:
                return
            if not checked.allows(len(sample.payload), now, rejected):  # before anything is copied
                continue
            attached, payload = sample.attachment, sample.payload.to_bytes()
            if payload.startswith(CANARY):
                checked.reject(rejected, "canary")
                continue
            try:
                origin = read_attachment(attached.to_bytes() if attached is not None else b"")
            except MessageError:
                checked.reject(rejected, "malformed")
                continue
            if not origin.publisher.endswith(self._mark):
                checked.reject(rejected, MISDIRECTED)
                continue
            yield origin, payload
        checked.reject(rejected, "overflow")  # it was full: the oldest may have been dropped


class BatchedTopics(Topic):
    """The keys of a process whose messages arrive in its batches (batch.py): the samples are those messages.

    A batch is counted and dropped too if it has a key that the process does not publish in batches.
    """

    def __init__(self, plan: Plan, key: Key, session: Session) -> None:
        super().__init__(plan, key, session, BATCHES)
        own = [one for one in plan.publishes[key.owner] if one in plan.batched]
        self._keys = {f"{one.owner}/{one.kind}": (_Checked(plan, one), mark_of(one)) for one in own}

    def samples(self, now: int, rejected: Counter[str]) -> Iterator[Sample]:
        """Yield the samples received by `now` (Unix ns); count dropped ones in `rejected`, by key and reason."""
        for origin, payload in self._received(now, rejected):
            try:
                batch = decode(Batch, payload)
            except MessageError:
                self._checked.reject(rejected, "malformed")
                continue
            session, keys = origin.publisher[:-4], self._keys
            if not all(entry[0] in keys for entry in batch.entries):
                self._checked.reject(rejected, MISDIRECTED)
                continue
            for text, sequence, sent, message in batch.entries:
                checked, mark = keys[text]
                if checked.allows(len(message), now, rejected):
                    yield sent, checked.name, session + mark, sequence, message


class _Checked:
    """One key's name and quota."""

    def __init__(self, plan: Plan, key: Key) -> None:
        row = ROWS[key.kind]
        self.name, self._quota, self._largest = f"/{plan.text(key)}", Quota(plan.rate(key)), row.largest

    def allows(self, size: int, now: int, rejected: Counter[str]) -> bool:
        """Return whether a message of `size` bytes is within the quota at `now` (Unix ns); else count it."""
        if size > self._largest or self._quota.exceeded(now):
            self.reject(rejected, OVER_QUOTA)
            return False
        return True

    def reject(self, rejected: Counter[str], reason: str) -> None:
        """Count a dropped message."""
        rejected[f"{self.name[1:]} {reason}"] += 1


def in_order(topics: Iterable[Topic], now: int, rejected: Counter[str]) -> list[Sample]:
    """Return the samples of all `topics` received by `now` (Unix ns), in the order of sending."""
    samples = [sample for topic in topics for sample in topic.samples(now, rejected)]
    samples.sort(key=itemgetter(0))
    return samples
