"""Stands for a session whose keys are read in batches: what is put on one waits until it is read."""

from collections import deque
from dataclasses import dataclass

from flockwire_core.domain.time import SECOND
from flockwire_core.runtime.samples import Rings
from flockwire_core.wire.batch import Batch, Entry
from flockwire_core.wire.codec import encode
from flockwire_core.wire.inbox import attachment
from flockwire_core.wire.keys import BATCH, Key

T0 = 1_790_000_000 * SECOND  # when a sample was sent


@dataclass
class Sample:
    """What Zenoh hands over."""

    payload: object
    attachment: object


class Bytes(bytes):
    """Bytes as Zenoh has them."""

    def to_bytes(self):
        """Return them."""
        return bytes(self)


class Ring(deque):
    """Samples that wait."""

    def try_recv(self):
        """Return the next one, None when there is none."""
        return self.popleft() if self else None


class BufferedSession:
    """Keeps what is put into it and what is published on it."""

    def __init__(self):
        self.rings, self.statuses, self.batches = {}, [], 0

    def every(self, key, capacity):
        """Return a ring of at most `capacity`."""
        return Rings((self.rings.setdefault(key, Ring(maxlen=capacity)),))

    def put(self, key, payload, sequence, sent=T0):
        """Let a sample arrive."""
        self.rings[key].append(Sample(Bytes(payload), Bytes(attachment(sequence, sent, b"p" * 16, key))))

    def put_batched(self, publisher, *samples):
        """Let samples (key, payload, sequence, sent) of a process arrive in one batch."""
        entries = [
            Entry(f"{key.owner}/{key.kind}", sequence, sent, payload) for key, payload, sequence, sent in samples
        ]
        self.put(Key(BATCH, publisher), encode(Batch(T0, "world", tuple(entries))), self.batches)
        self.batches += 1

    def publish(self, messages):
        """Keep the statuses."""
        self.statuses += [message for _, message in messages]

    def guard(self):
        """Shut nobody out: it has no socket."""

    def linked(self):
        """Return nobody."""
        return ()
