"""When a core steps, what it is handed before, and what is counted and told of it: the same in real and virtual time.

A core has no clock and no input or output. Whoever runs one (the shell of runtime.py on Zenoh, the simulation on its
event queue) tells a `Stepper` what has arrived and when its ticker ticks; the stepper decides the rest.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Protocol

from flockwire.inbox import Inbox
from flockwire.keys import Key, key_text
from flockwire.messages import Message
from flockwire.nanoseconds import BILLION
from flockwire.status import Report, Status

if TYPE_CHECKING:
    from flockwire.config import Swarm

STATUS_PERIOD = BILLION // 10
WATCHDOG_PERIODS = 2  # a core with a trigger steps without it after as many periods

Publish = Callable[[Iterable[tuple[Key, Message]]], None]


class Core(Protocol):
    """What a process does, without clock, input and output."""

    @property
    def trigger(self) -> Key | None:
        """The key whose arrival calls for a step; None for a core that steps at a rate of its own."""

    @property
    def prompt(self) -> frozenset[Key]:
        """Further keys that are handed over as soon as they arrive; all others rest until the next step."""

    @property
    def period(self) -> float:
        """Seconds between steps (with a trigger: when to step without one)."""

    def receive(self, key: Key, message: Message, now: int) -> None:
        """Take a message in at `now`, Unix time in ns."""

    def step(self, now: int) -> Iterable[tuple[Key, Message]]:
        """Return what to publish at `now`, Unix time in ns."""

    def report(self, now: int) -> Report:
        """Return how it is at `now`."""


class Source(Protocol):
    """The newest sample of one key."""

    inbox: Inbox

    def message(self, now: int) -> Message | None:
        """Return the message that came since the last call, None when there is none or it was turned away."""


class Vitals(Protocol):
    """What a process costs, and how it is connected."""

    def cpu_share(self, now: int) -> float:
        """Return the share of one core used since the last call."""

    def resident(self) -> int:
        """Return the bytes of memory in use."""

    def refused(self) -> int:
        """Return the connections refused so far."""

    def links(self) -> tuple[str, ...]:
        """Return who is linked, by authenticated identity."""


class Deadlines:
    """Counts steps, those that came late, and those that did not come."""

    def __init__(self) -> None:
        self.steps = self.late_1ms = self.late_5ms = self.skipped = 0

    def count(self, lateness: int, skipped: int) -> None:
        """Count one step that came `lateness` ns after its time, and `skipped` steps missed before it."""
        self.steps += 1
        self.late_1ms += lateness > 1_000_000
        self.late_5ms += lateness > 5_000_000
        self.skipped += skipped


def next_due(due: int, now: int, period: int) -> int:
    """Return when the next is due of what comes every `period` ns, was due at `due` and is done at `now`.

    A step that comes a little early or late does not shift those after it; long silence is not made up for.
    """
    return due + period if due + period > now else now + period


class StatusTeller:
    """Tells how a process is: a status message ten times a second, a line to `say` when its state changes."""

    def __init__(
        self, swarm: Swarm, identity: str, publish: Publish, vitals: Vitals, say: Callable[[str], None]
    ) -> None:
        self._key, self._frame, self._identity = Key("status", identity), swarm.frame, identity
        self._publish, self._vitals, self._say = publish, vitals, say
        self.due = 0  # when to tell next, Unix ns
        self._said = ""

    def tell(self, now: int, report: Report, counts: Deadlines, rejected: tuple[tuple[str, int], ...]) -> None:
        """Publish the status, and say the state if it is a new one."""
        self.due = next_due(self.due, now, STATUS_PERIOD)
        status = Status(
            now, self._frame, self._identity, report,
            counts.steps, counts.late_1ms, counts.late_5ms, counts.skipped, self._vitals.refused(),
            self._vitals.cpu_share(now), self._vitals.resident(), rejected, self._vitals.links(),
        )  # fmt: skip
        self._publish(((self._key, status),))
        said = f"{report.phase}: {report.detail}" if report.detail else str(report.phase)
        if said != self._said:
            self._said = said
            self._say(said)


def at_once(core: Core) -> frozenset[Key]:
    """Return the keys that are handed over as soon as they arrive; all others rest until the next step."""
    return core.prompt if core.trigger is None else core.prompt | {core.trigger}


def tick_period(core: Core) -> float:
    """Return the period of a core's ticker, s: its own, or with a trigger that of the watchdog for when it stops."""
    return core.period if core.trigger is None else WATCHDOG_PERIODS * core.period


class Stepper:
    """Steps one core. `resting` are the sources of the keys that rest until a step, `sources` all that it has."""

    def __init__(
        self,
        core: Core,
        swarm: Swarm,
        resting: Sequence[Source],
        sources: Sequence[Source],
        publish: Publish,
        teller: StatusTeller | None,
    ) -> None:
        self._core, self._publish, self._teller = core, publish, teller
        self._receive = core.receive
        self._trigger = core.trigger
        self._resting = tuple((source.inbox.key, source.message) for source in resting)
        self._named = tuple((key_text(swarm, source.inbox.key), source.inbox) for source in sources)
        self._deadlines = Deadlines()
        self._spacing = round(core.period / 2 * BILLION)
        self._next_stamp = 0
        self._stepped = False

    def arrived(self, source: Source, now: int) -> None:
        """Take in what has arrived of a key that does not rest; step when it is the trigger."""
        message = source.message(now)
        if message is None:
            return
        inbox = source.inbox
        self._receive(inbox.key, message, now)
        if inbox.key != self._trigger:
            return
        stamp = message.stamp
        if stamp >= self._next_stamp:  # poses may come faster than the control rate
            self._next_stamp = stamp + self._spacing
            self._deadlines.count(now - inbox.sent, inbox.missed)
            self._step(now)

    def tick(self, lateness: int, skipped: int, now: int) -> None:
        """Step for the ticker, which is `lateness` ns late and missed `skipped` ticks; not if a trigger did already."""
        stepped, self._stepped = self._stepped, False
        if self._trigger is None:
            self._deadlines.count(lateness, skipped)
        elif stepped:
            return
        self._step(now)

    def _step(self, now: int) -> None:
        self._stepped = True
        core, teller = self._core, self._teller
        for key, source_message in self._resting:
            message = source_message(now)
            if message is not None:
                self._receive(key, message, now)
        self._publish(core.step(now))
        if teller is not None and now >= teller.due:
            teller.tell(now, core.report(now), self._deadlines, self._rejected())

    def _rejected(self) -> tuple[tuple[str, int], ...]:
        return tuple(
            (f"{name} {reason}", count)
            for name, inbox in self._named
            if inbox.rejected
            for reason, count in inbox.rejected.items()
        )
