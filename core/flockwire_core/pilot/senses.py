"""What a follower's law sees and hears of others, and since when an in-neighbour is silent.

It sees as the gateway measured. The messages of laws go from drone to drone, repeated to who missed them, in order,
with a sign of life. No receiver confirms: a reverse key would be an edge that the graph does not have. A sender repeats
its newest messages as often as it sends, so that a receiver misses one only after a silence of that many.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Container, Iterable, Mapping, Sequence
from typing import Any, Final

from flockwire_core.domain.law_message import LawMessage
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.law import Heard, Pace, Seen
from flockwire_core.pilot.phases import age
from flockwire_core.wire.cdr import MessageError
from flockwire_core.wire.law_form import LawForm
from flockwire_core.wire.sighting import Sighting

HEARTBEAT: Final = SECOND // 20  # ns between two signs of life
MOST_KEPT: Final = 32  # messages that are repeated, at most
LARGEST_KEPT: Final = 16384  # bytes of them
MOST_NEWS: Final = 256  # of a neighbour, between two steps
NOBODY: Final = Sighting(0, "", (), ())


class Presence:
    """The in-neighbours with `numbers`; `stamps` is when each was noticed last, Unix ns, 0: never.

    One that was not noticed for `silence` s is `missing` at the last update.
    """

    def __init__(self, numbers: Iterable[int], silence: float) -> None:
        self.stamps = dict.fromkeys(numbers, 0)
        self.missing: tuple[int, ...] = ()
        self._silence, self.left_out = nanoseconds(silence), frozenset[int]()

    def leave_out(self, drones: Container[int]) -> None:
        """Ignore `drones` until called again."""
        self.left_out = frozenset([j for j in self.stamps if j in drones])

    def update(self, now: int) -> None:
        """Update who is missing at `now` (Unix ns)."""
        oldest = now - self._silence
        self.missing = tuple([j for j, stamp in self.stamps.items() if stamp < oldest and j not in self.left_out])

    def silence(self, now: int, since: int) -> float:
        """Return the time, s, since any was noticed, at most since `since`; 0 if none is expected."""
        stamps = [stamp for j, stamp in self.stamps.items() if j not in self.left_out]
        return age(max(since, *stamps), now) if stamps else 0.0

    def oldest(self, now: int) -> float:
        """Return the largest time, s, since one was noticed; NEVER if one never was."""
        return max([age(stamp, now) for j, stamp in self.stamps.items() if j not in self.left_out], default=0.0)


class Sight(Presence):
    """The in-neighbours of one drone, by their `weights`, and the drones around; those of `leaders` say so.

    What is older than `silence` s is not used. `neighbours` and `around` are of the last update.
    """

    def __init__(self, weights: Mapping[int, float], leaders: Container[int], silence: float) -> None:
        super().__init__(weights, silence)
        self._weights, self._leaders = weights, leaders
        self._last = NOBODY
        self.neighbours: Sequence[Seen] = ()
        self.around: Sequence[Seen] = ()

    def take(self, sighting: Sighting) -> None:
        """Receive what the drone sees; an entry that is no in-neighbour is left out."""
        self._last = sighting
        for seen in sighting.neighbours:
            if seen.number in self.stamps:
                self.stamps[seen.number] = sighting.stamp

    def update(self, now: int) -> None:
        """Update what is seen at `now` (Unix ns)."""
        super().update(now)
        last = self._last
        if last.stamp < now - self._silence:
            self.neighbours = self.around = ()
            return
        self.around = last.around
        self.neighbours = [
            Seen(
                seen.number, self._weights[seen.number], seen.number in self._leaders, seen.bearing, seen.distance,
                seen.position, seen.velocity, seen.age,
            )
            for seen in last.neighbours
            if seen.number in self._weights and seen.number not in self.left_out
        ]  # fmt: skip


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
