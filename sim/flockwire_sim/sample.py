"""What travels: encoded messages with their attachments, opened once however many read them."""

from __future__ import annotations

from flockwire.inbox import Inbox, Opened, open_sample
from flockwire.keys import Row
from flockwire.messages import Message


class Sample:
    """One encoded message on the wire."""

    __slots__ = ("_opened", "_sealed", "attached", "payload", "row")

    def __init__(self, row: Row, payload: bytes, attached: bytes) -> None:
        self.row, self.payload, self.attached, self._sealed = row, payload, attached, True

    def opened(self) -> Opened | None:
        """Return what it holds, decoded at the first call; None when it is malformed."""
        if self._sealed:
            self._sealed = False
            self._opened = open_sample(self.row, self.payload, self.attached)
        return self._opened


Parcel = tuple[int, Sample]  # a sample, and its place among what its reader hears


class Slot:
    """The newest sample of a key, as it rests with a process until it is asked for."""

    __slots__ = ("inbox", "prompt", "sample")

    def __init__(self, inbox: Inbox, prompt: bool) -> None:
        self.inbox, self.prompt = inbox, prompt
        self.sample: Sample | None = None

    def message(self, now: int) -> Message | None:
        """Return the message that came since the last call, None when there is none or it was turned away."""
        sample = self.sample
        if sample is None:
            return None
        self.sample = None
        return self.inbox.admit(sample.opened(), now)
