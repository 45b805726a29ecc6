"""Keys as ROS 2 topics: every sample with its undecoded payload."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from operator import itemgetter

from flockwire.runtime.session import Session
from flockwire.wire.cdr import MessageError
from flockwire.wire.inbox import BURST, CANARY, MISDIRECTED, OVER_QUOTA, Quota, mark_of, read_attachment
from flockwire.wire.keys import ROWS, Key
from flockwire.wire.plan import Plan
from flockwire.wire.schemas import ROS_TYPES

CAPACITY = 2048  # samples of one key that are buffered between two reads, at most

Sample = tuple[int, str, bytes, int, bytes]  # source time (Unix ns), topic, publisher, sequence, payload (CDR)


class Topic:
    """One key: its ROS 2 topic `name`, the `ros_type` of its messages, and its samples.

    Samples over the quota, with an unknown attachment, or of another key are counted and dropped.
    """

    def __init__(self, plan: Plan, key: Key, session: Session) -> None:
        row = ROWS[key.kind]
        self.name, self.ros_type = f"/{plan.text(key)}", ROS_TYPES[row.message]
        self._samples = session.every(key, min(CAPACITY, BURST * row.rate))
        self._quota, self._largest, self._mark = Quota(row.rate), row.largest, mark_of(key)

    def samples(self, now: int, rejected: Counter[str]) -> Iterator[Sample]:
        """Yield the samples received by `now` (Unix ns); count dropped ones in `rejected`, by key and reason."""
        while (sample := self._samples.try_recv()) is not None:
            if len(sample.payload) > self._largest or self._quota.exceeded(now):  # before anything is copied
                self._reject(rejected, OVER_QUOTA)
                continue
            attached, payload = sample.attachment, sample.payload.to_bytes()
            if payload.startswith(CANARY):
                self._reject(rejected, "canary")
                continue
            try:
                origin = read_attachment(attached.to_bytes() if attached is not None else b"")
            except MessageError:
                self._reject(rejected, "malformed")
                continue
            if not origin.publisher.endswith(self._mark):
                self._reject(rejected, MISDIRECTED)
                continue
            yield origin.sent, self.name, origin.publisher, origin.sequence, payload

    def _reject(self, rejected: Counter[str], reason: str) -> None:
        rejected[f"{self.name[1:]} {reason}"] += 1


def in_order(topics: Iterable[Topic], now: int, rejected: Counter[str]) -> list[Sample]:
    """Return the samples of all `topics` received by `now` (Unix ns), in the order of sending."""
    samples = [sample for topic in topics for sample in topic.samples(now, rejected)]
    samples.sort(key=itemgetter(0))
    return samples
