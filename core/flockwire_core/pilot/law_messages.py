"""The messages of a law from drone to drone: repeated to who missed them, in order, with a sign of life.

No receiver confirms: a reverse key would be an edge that the graph does not have. A sender repeats its newest messages
as often as it sends, so that a receiver misses one only after a silence of that many.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Container, Mapping
from typing import Any, Final

from flockwire_core.domain.law_message import LawMessage
from flockwire_core.domain.time import SECOND
from flockwire_core.law import Heard, Pace
from flockwire_core.pilot.sight import Presence
from flockwire_core.wire.cdr import MessageError
from flockwire_core.wire.law_form import LawForm

HEARTBEAT: Final = SECOND // 20  # ns between two signs of life
MOST_KEPT: Final = 32  # messages that are repeated, at most
LARGEST_KEPT: Final = 16384  # bytes of them
MOST_NEWS: Final = 256  # of a neighbour, between two steps


class LawSender:
    """Sends the messages of one drone's law at its `pace`; the process was started at `born` (Unix ns)."""

    def __init__(self, form: LawForm, pace: Pace, frame: str, born: int) -> None:
        self._frame, self._born = frame, born
        most = 1 if pace is Pace.STEP else max(1, min(MOST_KEPT, LARGEST_KEPT // (form.size + 8)))
        self._repeats = pace is not Pace.STEP
        self._kept: deque[tuple[int, bytes]] = deque(maxlen=most)
        self._sequence, self._due = 0, 0  # when the next sign of life is due, Unix ns

    def send(self, message: bytes | None, now: int, stamp: int = 0) -> LawMessage | None:
        """Return what to publish at `now` (Unix ns) for the law's `message`, None: it has none in this step.

        The message is one of the form, packed, and valid for `stamp` (0: now).
        """
        if message is not None:
            self._kept.append((stamp or now, message))
            self._sequence += 1
        elif now < self._due:
            return None
        self._due = now + HEARTBEAT if message is not None else max(self._due, now - HEARTBEAT) + HEARTBEAT
        contents = tuple(self._kept) if message is not None or self._repeats else ()
        return LawMessage(now, self._frame, self._born, self._sequence, contents)


class Speaker:
    """One in-neighbour j whose messages are received, with w_ij and whether it is a leader."""

    def __init__(self, number: int, weight: float, leads: bool, form: LawForm) -> None:
        self.newest: Heard | None = None
        self.news: list[Heard] = []
        self.lost = self.rejected = 0  # messages missed for good; messages of another form
        self.number, self._weight, self._leads, self._form = number, weight, leads, form
        self._epoch = self._sequence = 0

    def take(self, message: LawMessage) -> None:
        """Receive its newest messages: those that are new, in order."""
        if message.epoch != self._epoch:  # its process was started, or this one
            self._epoch, self._sequence = message.epoch, 0
        number = message.sequence - len(message.contents)
        for stamp, data in message.contents:
            number += 1
            if number <= self._sequence:
                continue
            try:
                content: Any = self._form.unpack(data)
            except MessageError:
                self.rejected += 1
                continue
            self.lost += number - self._sequence - 1 if self._sequence else 0
            self._sequence = number
            self.newest = Heard(self.number, self._weight, self._leads, stamp, number, content)
            if len(self.news) < MOST_NEWS:
                self.news.append(self.newest)
            else:
                self.lost += 1


class Hearing(Presence):
    """The messages of all in-neighbours of one drone, by their `weights`; those of `leaders` say so.

    A neighbour whose process is silent for `silence` s is `missing`, however old its last message may be; at the pace
    STEP a message is used no longer than that either.
    """

    def __init__(
        self, weights: Mapping[int, float], leaders: Container[int], form: LawForm, pace: Pace, silence: float
    ) -> None:
        super().__init__(weights, silence)
        self.speakers = {j: Speaker(j, weight, j in leaders, form) for j, weight in weights.items()}
        self._ages = pace is Pace.STEP
        self.heard: list[Heard] = []  # of the last update
        self.news: list[Heard] = []

    def take(self, j: int) -> Callable[[LawMessage], None]:
        """Return the handler of neighbour j's messages."""
        speaker = self.speakers[j]

        def take(message: LawMessage) -> None:
            """Receive one message."""
            self.stamps[j] = message.stamp  # each is a sign of life
            speaker.take(message)

        return take

    def update(self, now: int) -> None:
        """Update what is heard at `now` (Unix ns): of each neighbour the newest message, and all since then."""
        super().update(now)
        oldest = now - self._silence
        heard: list[Heard] = []
        news: list[Heard] = []
        for j, speaker in self.speakers.items():
            arrived, speaker.news = speaker.news, []
            if j in self.left_out:
                continue
            news += arrived
            newest = speaker.newest
            if newest is not None and self.stamps[j] >= oldest and not (self._ages and newest.stamp < oldest):
                heard.append(newest)
        self.heard, self.news = heard, news
