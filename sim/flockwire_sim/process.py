"""A process in virtual time: one core with its clock, its ticker and its inboxes, run as the real shell runs it."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from hashlib import blake2b
from typing import NamedTuple

from flockwire.flight.cores import Core
from flockwire.flight.stepping import StatusPublisher, Stepper, at_once, tick_period
from flockwire.nanoseconds import BILLION
from flockwire.swarm.model import Swarm
from flockwire.wire.inbox import ATTACHMENT, Inbox
from flockwire.wire.keys import ROWS, Key, KeyRow, key_text
from flockwire.wire.messages import Message

from flockwire_sim.local_clock import LocalClock
from flockwire_sim.network import VirtualLink
from flockwire_sim.sample import Parcel, Sample, Slot
from flockwire_sim.scheduler import Scheduler


class Published(NamedTuple):
    """One message as it was published: `at` is the true time, `sent` what its publisher's clock showed (Unix ns)."""

    at: int
    sent: int
    key: Key
    topic: str
    publisher: bytes
    sequence: int
    sample: Sample


Tap = Callable[[Published], None]
MakeCore = Callable[[int, int], Core]  # from the own clock's time (Unix ns) and how often it was started before


class Outlet:
    """One key that a process publishes, and the links and places of all its subscribers."""

    def __init__(self, swarm: Swarm, key: Key) -> None:
        self.row: KeyRow = ROWS[key.kind]
        self.topic = f"/{key_text(swarm, key)}"
        self.sequence = 0
        self.readers: list[tuple[VirtualLink, int]] = []


class NoResources:
    """What a process in virtual time costs: nothing that would be the same the next time. It needs no links either."""

    def cpu_share(self, now: int) -> float:
        """Return 0."""
        return 0.0

    def resident(self) -> int:
        """Return 0."""
        return 0

    def refused(self) -> int:
        """Return 0."""
        return 0

    def links(self) -> tuple[str, ...]:
        """Return nobody."""
        return ()


class VirtualProcess:
    """The process of `identity`; it subscribes to the keys `subscribed`, in their order, and publishes `outlets`."""

    def __init__(
        self,
        swarm: Swarm,
        identity: str,
        make_core: MakeCore,
        subscribed: tuple[Key, ...],
        clock: LocalClock,
        scheduler: Scheduler,
        seed: int,
        tap: Tap | None,
        reports: bool,
    ) -> None:
        self.identity, self.subscribed, self.clock = identity, subscribed, clock
        self.outlets: dict[Key, Outlet] = {}
        self.alive = False
        self._swarm, self._make_core, self._scheduler, self._seed, self._tap = swarm, make_core, scheduler, seed, tap
        self._starts, self._reports = 0, reports
        self._frozen = False
        self._told = self._retired = False
        self._slots: list[Slot] = []
        self._waiting: dict[int, Slot] = {}
        self._loaded: list[VirtualLink] = []
        self._now = 0

    def start(self, _: object = None) -> None:
        """Start, or after a `kill` restart, with nothing known."""
        if self.alive:
            return
        self._now = self.clock.read(self._scheduler.now)
        core = self._core = self._make_core(self._now, self._starts)
        self._starts += 1
        self.alive, self._frozen, self._missed = True, False, 0
        self._told = self._retired = False
        self._publisher = blake2b(f"{self._seed} {self.identity} {self._starts}".encode(), digest_size=16).digest()
        prompt = at_once(core)
        self._slots = [Slot(Inbox(key, ROWS[key.kind]), key in prompt) for key in self.subscribed]
        self._waiting = {}
        for outlet in self.outlets.values():
            outlet.sequence = 0
        status = StatusPublisher(self._swarm, self.identity, self._publish, NoResources(), _log_nothing)
        buffered = [slot for slot in self._slots if not slot.prompt]
        self._stepper = Stepper(
            core, self._swarm, buffered, self._slots, self._publish, status if self._reports else None
        )
        self._period = self.clock.true_length(round(tick_period(core) * BILLION))
        self._scheduler.at(self._scheduler.now + self._period, self._tick, self._starts)

    def kill(self, _: object = None) -> None:
        """End at once."""
        self.alive = False
        self._waiting = {}

    def retire(self, _: object = None) -> None:
        """Let it end (SIGTERM): it does at a tick at which its core may, and not while it stands still."""
        self._told = True

    def freeze(self, _: object = None) -> None:
        """Stand still: of what arrives the newest is buffered."""
        self._frozen = True

    def thaw(self, _: object = None) -> None:
        """Go on, beginning with what is buffered."""
        self._frozen = False
        waiting, self._waiting = self._waiting, {}
        for slot in waiting.values():
            self._arrived(slot)

    def deliver(self, load: list[Parcel]) -> None:
        """Take in what has arrived together."""
        if not self.alive:
            return
        for place, sample in load:
            slot = self._slots[place]
            slot.sample = sample
            if slot.prompt:
                if self._frozen:
                    self._waiting[place] = slot
                else:
                    self._arrived(slot)

    def _arrived(self, slot: Slot) -> None:
        now = self._now = self.clock.read(self._scheduler.now)
        self._stepper.arrived(slot, now)
        if self._loaded:
            self._depart()

    def _tick(self, starts: int) -> None:
        if not self.alive or starts != self._starts:
            return
        self._scheduler.at(self._scheduler.now + self._period, self._tick, starts)
        if self._frozen:
            self._missed += 1
            return
        missed, self._missed = self._missed, 0
        now = self._now = self.clock.read(self._scheduler.now)
        if self._told and self._ends(now):
            self.kill()
            return
        self._stepper.tick(0, missed, now)
        if self._loaded:
            self._depart()

    def _ends(self, now: int) -> bool:
        if not self._retired:
            self._retired = True
            self._core.retire(now)
        return self._core.may_end(now)

    def _publish(self, messages: Iterable[tuple[Key, Message]]) -> None:
        now, publisher, loaded, tap = self._now, self._publisher, self._loaded, self._tap
        for key, message in messages:
            outlet = self.outlets[key]
            sequence = outlet.sequence
            outlet.sequence = sequence + 1
            sample = Sample(outlet.row, message.encode(), ATTACHMENT.pack(sequence, now, 16, publisher))
            for link, place in outlet.readers:
                load = link.load
                if not load:
                    loaded.append(link)
                load.append((place, sample))
            if tap is not None:
                tap(Published(self._scheduler.now, now, key, outlet.topic, publisher, sequence, sample))

    def _depart(self) -> None:
        loaded, self._loaded = self._loaded, []
        for link in loaded:
            link.depart()


def _log_nothing(_: str) -> None:
    pass
