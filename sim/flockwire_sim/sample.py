"""Encoded messages with their attachments, decoded once for all receivers."""

from __future__ import annotations

from flockwire.wire.codec import Message
from flockwire.wire.inbox import Inbox, Opened, open_sample
from flockwire.wire.keys import KeyRow


class Sample:
    """One encoded message on the wire."""

    __slots__ = ("_opened", "_sealed", "attached", "payload", "row")

    def __init__(self, row: KeyRow, payload: bytes, attached: bytes) -> None:
        self.row, self.payload, self.attached, self._sealed = row, payload, attached, True

    def opened(self) -> Opened | None:
        """Return the message, decoded at the first call; None if it is malformed."""
        if self._sealed:
            self._sealed = False
            self._opened = open_sample(self.row, self.payload, self.attached)
        return self._opened


Parcel = tuple[int, Sample]  # a sample, and the index of its subscription


class Slot:
    """The newest sample of a key, buffered at a process until it is read."""

    __slots__ = ("inbox", "prompt", "sample")

    def __init__(self, inbox: Inbox, prompt: bool) -> None:
        self.inbox, self.prompt = inbox, prompt
        self.sample: Sample | None = None

    def message(self, now: int) -> Message | None:
        """Return the message since the last call, None if there is none or it was rejected."""
        sample = self.sample
        if sample is None:
            return None
        self.sample = None
        return self.inbox.admit(sample.opened(), now)
