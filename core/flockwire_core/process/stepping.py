"""Steps a core: its inputs, counts and reports, the same in real and virtual time.

A core has no clock and no input or output. A runner (runtime/shell.py on Zenoh, the simulation on its event queue)
passes arrived messages and ticks to a `Stepper`, which decides when to step.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Final, NamedTuple

from flockwire_core.domain.time import SECOND
from flockwire_core.process.cores import Core, Framed, Stopwatch
from flockwire_core.process.timekeeping import Timekeeping
from flockwire_core.wire.codec import Message
from flockwire_core.wire.inbox import Input, rejections, shifted
from flockwire_core.wire.keys import Key, key_text
from flockwire_core.wire.status import Counts, Report, Status

STATUS_PERIOD: Final = SECOND // 10
WATCHDOG_TICKS: Final = 2  # without a trigger, after which such a core steps at one; one more with slow triggers

Publish = Callable[[Iterable[tuple[Key, Message]]], None]


class Resources(NamedTuple):
    """What a process costs, and how it is connected."""

    cpu: float  # share of one core since the last status
    resident: int  # bytes, peak
    refused: int  # connections
    links: tuple[str, ...]  # the linked processes, by authenticated identity


class StepCounts:
    """Counts steps, those more than 1 and 5 ms late, and skipped ones.

    The delay counts from the due time of the ticker, or from the sending of the triggering message; for a pilot it
    includes the network and its own machine.
    """

    def __init__(self) -> None:
        self.steps = self.delayed_1ms = self.delayed_5ms = self.skipped = 0

    def count(self, delay: int, skipped: int) -> None:
        """Count one step with a delay of `delay` ns, and `skipped` steps before it."""
        self.steps += 1
        self.delayed_1ms += delay > 1_000_000
        self.delayed_5ms += delay > 5_000_000
        self.skipped += skipped


def next_deadline(deadline: int, now: int, period: int) -> int:
    """Return the next deadline (ns) of a periodic task with the last deadline `deadline`, done at `now`.

    A step that is a little early or late does not shift later ones; missed periods are skipped.
    """
    return deadline + period if now < deadline + period <= now + 2 * period else now + period


def is_due(deadline: int, now: int, period: int) -> bool:
    """Return whether a periodic task is due at `now`, also after swarm time was set back below its last deadline.

    For what runs on swarm time itself, beside cores: a core's time never goes back.
    """
    return now >= deadline or now < deadline - period


class StatusPublisher:
    """Publishes the status of the process `identity` ten times a second, and logs changes of its state.

    `frame` is the name of the world frame; `resources` returns those at a time (Unix ns).
    """

    def __init__(
        self,
        frame: str,
        identity: str,
        publish: Publish,
        resources: Callable[[int], Resources],
        timekeeping: Timekeeping,
        log: Callable[[str], None],
    ) -> None:
        self._key, self._frame, self._identity = Key("status", identity), frame, identity
        self._publish, self._resources, self._timekeeping, self._log = publish, resources, timekeeping, log
        self.deadline = 0  # of the next status, Unix ns
        self.stopwatch: Stopwatch | None = None  # what it measures is reported; none in virtual time
        self._logged = ""

    def due(self, now: int) -> bool:
        """Return whether the next status is due."""
        return is_due(self.deadline, now, STATUS_PERIOD)

    def update(self, now: int, report: Report, counts: StepCounts, rejected: Counts, ahead: int = 0) -> None:
        """Publish the status at `now`, which is `ahead` ns ahead of swarm time (Stepper), and log a new state."""
        self.deadline = next_deadline(self.deadline, now, STATUS_PERIOD)
        offset, bound = self._timekeeping.figures(now)
        slow = self.stopwatch.reason() if self.stopwatch is not None else None
        if slow is not None:
            report = report._replace(reasons=(*report.reasons, slow))
        if report.mission is not None and ahead:
            report = report._replace(mission=report.mission.shift(-ahead))
        cpu, resident, refused, links = self._resources(now)
        status = Status(
            now - ahead, self._frame, self._identity, report,
            counts.steps, counts.delayed_1ms, counts.delayed_5ms, counts.skipped, refused,
            cpu, resident, rejected, links, offset, bound,
        )  # fmt: skip
        self._publish(((self._key, status),))
        line = report.line
        state = f"{report.phase}: {line}" if line else report.phase
        if state != self._logged:
            self._logged = state
            self._log(state)


def prompt_keys(core: Core) -> frozenset[Key]:
    """Return the keys that are received at once; all others are buffered until the next step."""
    return core.prompt | core.triggers


def tick_period(core: Core) -> float:
    """Return the period of a core's ticker, s: its own or, with triggers, that of the watchdog."""
    return 2 * core.period if core.triggers else core.period  # of a core with triggers, between two ticks


class Stepper:
    """Steps one core. `buffered` are the inputs read at each step, `inputs` all inputs.

    Faster triggers than the core's rate make it step at its rate on average: each step moves the earliest stamp of the
    next one by a period. A trigger that is up to a period late delays no other, and after a longer gap the next trigger
    makes a step. Each slower trigger makes a step.

    A core's time never goes back and has no steps: a step of the process's clock, swarm time, moves the core's time
    `ahead` of it by as much, and all times in messages by so much on their way in and out.

    `flush` sends the datagrams of a core that has some, after each received message and each step. While triggers
    arrive, ticks make no step.
    """

    def __init__(
        self,
        core: Core,
        swarm_name: str,
        buffered: Sequence[Input],
        inputs: Sequence[Input],
        publish: Publish,
        timekeeping: Timekeeping,
        status: StatusPublisher | None,
    ) -> None:
        self._core, self._publish, self._status = core, publish, status
        self.flush: Callable[[int], None] | None = None
        self._timekeeping = timekeeping
        timekeeping.follow(lambda by: self._shift(-by))
        self._receive, self._due = core.receive, core.due if isinstance(core, Framed) else None
        self._triggers = core.triggers
        self._buffered = tuple(buffered)
        self._named = tuple((key_text(swarm_name, source.inbox.key), source.inbox) for source in inputs)
        self._ahead = self._last = 0  # ns of the core's time ahead of swarm time, and its last time
        self._counts = StepCounts()
        self._period = round(core.period * SECOND)
        self._earliest = 0  # stamp of the trigger that makes the next step, Unix ns
        self._ticks = WATCHDOG_TICKS - 1  # since the last step; one less after a long gap

    def time(self, swarm_time: int) -> int:
        """Return the core's time at `swarm_time`, ns; it never decreases."""
        now = swarm_time + self._ahead
        if now < self._last:
            self._shift(self._last - now)
            now = self._last
        self._last = now
        return now

    def _shift(self, by: int) -> None:
        """Move the core's time ahead of swarm time by `by` ns: the clock was set back by as much."""
        self._ahead += by
        for _, inbox in self._named:
            if inbox.key not in self._timekeeping.keys:
                inbox.ahead = self._ahead

    def arrived(self, source: Input, now: int) -> None:
        """Receive a message of a key that is not buffered; step if it is a trigger and a step is due."""
        now = self.time(now)
        message = source.message(now)
        if message is None:
            return
        inbox = source.inbox
        key = inbox.key
        self._receive(key, message, now)
        if self.flush is not None:
            self.flush(now)
        if key not in self._triggers or (self._due is not None and not self._due(key)):
            return
        stamp = message.stamp
        late, period = stamp - self._earliest, self._period
        if late >= 0 or late < -period:
            self._earliest = self._earliest + period if 0 <= late < period else stamp
            self._ticks = 0 if late < 3 * period // 2 else -1
            self._counts.count(now - self._ahead - inbox.sent, inbox.missed)
            self._step(now)

    def step_on_external_input(self, now: int) -> None:
        """Step for input that is not from a key."""
        self._ticks = 0
        self._counts.count(0, 0)
        self._step(self.time(now))

    def tick(self, lateness: int, skipped: int, now: int) -> None:
        """Step for the ticker, with `lateness` ns and `skipped` ticks; not while triggers arrive."""
        swarm_time, now = now, self.time(now)
        if not self._triggers:
            self._counts.count(lateness, skipped)
            self._step(now)
        elif (ticks := self._ticks + 1) < WATCHDOG_TICKS:
            self._ticks = ticks
        else:
            self._ticks = 0
            self._step(now)
        if outgoing := self._timekeeping.step(swarm_time):  # it may correct the clock: no time is used after it
            self._publish(outgoing)

    def _step(self, now: int) -> None:
        core = self._core
        for source in self._buffered:
            message = source.message(now)
            if message is not None:
                self._receive(source.inbox.key, message, now)
        messages = core.step(now)
        if self.flush is not None:
            self.flush(now)
        ahead = self._ahead
        self._publish(messages if not ahead else [(key, shifted(message, -ahead)) for key, message in messages])
        status = self._status
        if status is not None and status.due(now):
            status.update(now, self._core.report(now), self._counts, rejections(self._named), ahead)
