"""A process in virtual time: one core with its clock, ticker and inboxes, run like the real shell."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable
from hashlib import blake2b
from typing import Final

from flockwire_core.compiling import mypyc_attr
from flockwire_core.domain.law_message import LawMessage, Signals
from flockwire_core.domain.order import Mission
from flockwire_core.domain.record import Record
from flockwire_core.domain.time import SECOND
from flockwire_core.process.cores import Core, Datagram, Networked
from flockwire_core.process.stepping import Resources, StatusPublisher, Stepper, prompt_keys, tick_period
from flockwire_core.process.timekeeping import is_known, patience, timekeeping
from flockwire_core.wire.codec import Message
from flockwire_core.wire.inbox import Inbox, publisher_of
from flockwire_core.wire.keys import ROWS, Key, KeyRow
from flockwire_core.wire.plan import Plan
from flockwire_core.wire.sighting import Sighting
from flockwire_core.wire.status import Status

from flockwire_lab.faults.faulty_core import FaultyCore
from flockwire_lab.network import DatagramNetwork, Parcel, Sample, Slot, VirtualLink
from flockwire_lab.rare import RareBranches
from flockwire_lab.virtual_time import LocalClock, Scheduler

UNREAD = 256  # datagrams in the socket of a frozen process
POLL = SECOND // 50  # ns between two checks for swarm time
SEALED = (LawMessage, Sighting, Signals, Mission, Status)  # users' laws fill them, or their bytes do not hold all


@mypyc_attr(acyclic=True)
class Published(Record):
    """One published message; `at` is the true time (Unix ns), that in `sample` the publisher's."""

    __slots__ = ("at", "key", "topic", "sample")

    def __init__(self, at: int, key: Key, topic: str, sample: Sample) -> None:
        self.at: Final = at
        self.key: Final = key
        self.topic: Final = topic
        self.sample: Final = sample

    @property
    def message(self) -> Message | None:
        """The message, None if it is malformed."""
        return self.sample.message()


Tap = Callable[[Published], None]
MakeCore = Callable[[int, int], Core]  # takes the own clock's time (Unix ns) and the number of earlier starts


class Outlet:
    """One published key, with the links and indices of all its subscribers."""

    def __init__(self, plan: Plan, key: Key) -> None:
        self.row: KeyRow = ROWS[key.kind]
        self.sealed = self.row.message in SEALED
        self.topic = f"/{plan.text(key)}"
        self.sequence, self.publisher = 0, b""
        self.readers: list[tuple[VirtualLink, int]] = []


NO_RESOURCES: Final = Resources(0.0, 0, 0, ())  # in virtual time: constants, so that flights are repeatable


class VirtualProcess:
    """The process `identity` of `plan`, which publishes `outlets`; its timer is sometimes late, by `rare`."""

    def __init__(
        self,
        plan: Plan,
        identity: str,
        make_core: MakeCore,
        clock: LocalClock,
        scheduler: Scheduler,
        network: DatagramNetwork,
        seed: int,
        tap: Tap | None,
        rare: RareBranches | None,
    ) -> None:
        self.identity, self.clock, self.alive = identity, clock, False
        self.outlets: dict[Key, Outlet] = {}
        self.subscribed = plan.subscribes[identity]
        if identity in plan.recorders:  # the recorder tap receives everything else
            self.subscribed = tuple(timekeeping(plan, identity, clock.correct).keys)
        self._plan, self._make_core, self._scheduler, self._network = plan, make_core, scheduler, network
        self._seed, self._tap, self._rare, self._starts = seed, tap, rare, 0
        self._unread: deque[Datagram] = deque(maxlen=UNREAD)
        self._waiting: dict[int, Slot] = {}
        self._each: deque[tuple[Slot, Sample]] = deque(maxlen=UNREAD)  # keys of which every message is read
        self._loaded: list[VirtualLink] = []

    def start(self, _: object = None) -> None:
        """Start, or restart after a `kill`, without state."""
        if self.alive:
            return
        self.clock.correct(0)
        now = self._now = self.clock.read(self._scheduler.now)
        self._starts += 1
        self.alive, self._frozen, self._edited, self._missed = True, False, False, 0
        self._told = self._retired = False
        self._networked: Networked | None = None
        self._stepper: Stepper | None = None  # None until swarm time is known
        session = blake2b(f"{self._seed} {self.identity} {self._starts}".encode(), digest_size=16).digest()
        for key, outlet in self.outlets.items():
            outlet.sequence, outlet.publisher = 0, publisher_of(session, key)
        self._timekeeping = timekeeping(self._plan, self.identity, self.clock.correct)
        timing = self._timekeeping.keys
        self._slots = [Slot(Inbox(key), key in timing, key in timing) for key in self.subscribed]
        if is_known(self._timekeeping, now):
            self._begin()
        else:
            self._scheduler.at(self._scheduler.now, self._wait, self._starts)

    def _wait(self, starts: int, waited: int = 0) -> None:
        """Request swarm time until it is known, for the process's patience at most."""
        if not self.alive or starts != self._starts:
            return
        if self._told:
            self.kill()
            return
        now = self._now = self.clock.read(self._scheduler.now)
        if is_known(self._timekeeping, now) or waited >= patience(self._plan, self.identity) * SECOND:
            self._begin()
            return
        if not self._frozen:
            self._publish(self._timekeeping.step(now))
            self._depart()
        self._scheduler.at(self._scheduler.now + POLL, lambda _: self._wait(starts, waited + POLL))

    def _begin(self) -> None:
        """Run the core from now on."""
        timekeeping = self._timekeeping
        core = self._core = self._make_core(self._now, self._starts - 1)
        self._edited = isinstance(core, FaultyCore)
        prompt = prompt_keys(core) | timekeeping.keys
        self._slots = [Slot(slot.inbox, slot.timing, slot.inbox.key in prompt) for slot in self._slots]
        status = StatusPublisher(
            self._plan.swarm.frame, self.identity, self._publish, lambda _: NO_RESOURCES, timekeeping, lambda _: None
        )
        buffered = [slot for slot in self._slots if not slot.prompt]
        self._stepper = Stepper(
            core, self._plan.swarm.name, buffered, self._slots, self._publish, timekeeping,
            None if self.identity in self._plan.operators else status,
        )  # fmt: skip
        if isinstance(core, Networked) and core.sockets:
            self._networked, self._stepper.flush = core, self._flush
            for address in core.sockets:
                self._network.bind(address, self._take_datagram)
        self._period = self.clock.true_length(round(tick_period(core) * SECOND))
        self._scheduler.at(self._scheduler.now + self._period, self._tick, self._starts)

    def kill(self, _: object = None) -> None:
        """End at once."""
        self.alive = False
        self._waiting = {}
        self._each.clear()
        self._unread.clear()

    def retire(self, _: object = None) -> None:
        """Ask it to end (SIGTERM): it ends at a tick at which its core may, not while it is frozen."""
        self._told = True

    def freeze(self, _: object = None) -> None:
        """Freeze: the newest messages are buffered."""
        self._frozen = True

    def thaw(self, _: object = None) -> None:
        """Continue with the buffered messages."""
        self._frozen = False
        waiting, self._waiting = self._waiting, {}
        for slot in waiting.values():
            self._arrived(slot)
        while self._each:
            slot, sample = self._each.popleft()
            slot.sample = sample
            self._arrived(slot)
        while self._unread:
            self._take_datagram(self._unread.popleft())

    def deliver(self, load: list[Parcel]) -> None:
        """Receive messages that arrived together."""
        if not self.alive:
            return
        for place, sample in load:
            slot = self._slots[place]
            slot.sample = sample
            if slot.prompt:
                if self._frozen and slot.inbox.keep_all:
                    self._each.append((slot, sample))
                elif self._frozen:
                    self._waiting[place] = slot
                else:
                    self._arrived(slot)

    def _take_datagram(self, datagram: Datagram) -> None:
        """Receive a datagram; a frozen process reads it from its socket later."""
        networked, stepper = self._networked, self._stepper
        if not self.alive or networked is None or stepper is None:
            return
        if self._frozen:
            self._unread.append(datagram)
            return
        self._now = self.clock.read(self._scheduler.now)
        now = stepper.time(self._now)
        networked.datagram(datagram.data, datagram.source, datagram.target, now)
        self._flush(now)

    def _flush(self, now: int) -> None:
        for datagram in self._networked.outgoing(now) if self._networked is not None else ():
            self._network.send(datagram)

    def _arrived(self, slot: Slot) -> None:
        now = self._now = self.clock.read(self._scheduler.now)
        if slot.timing:
            message = slot.message(now)
            if message is not None:
                self._publish(self._timekeeping.receive(slot.inbox.key, message, now))
        elif self._stepper is not None:
            self._stepper.arrived(slot, now)
        if self._loaded:
            self._depart()

    def _tick(self, starts: int) -> None:
        stepper = self._stepper
        if not self.alive or starts != self._starts or stepper is None:
            return
        late = self._rare.late_timer() if self._rare is not None else 0
        self._scheduler.at(self._scheduler.now + self._period + late, self._tick, starts)
        if self._frozen:
            self._missed += 1
            return
        missed, self._missed = self._missed, 0
        now = self._now = self.clock.read(self._scheduler.now)
        if self._told and self._ends(stepper.time(now)):
            self.kill()
            return
        stepper.tick(0, missed, now)
        self._missed += late // self._period
        if self._loaded:
            self._depart()

    def _ends(self, now: int) -> bool:
        if not self._retired:
            self._retired = True
            self._core.retire(now)
        return self._core.may_end(now)

    def _publish(self, messages: Iterable[tuple[Key, Message]]) -> None:
        now, loaded, tap, edited = self._now, self._loaded, self._tap, self._edited
        for key, message in messages:
            outlet = self.outlets[key]
            sample = Sample(outlet.row, message, outlet.sequence, now, outlet.publisher, edited or outlet.sealed)
            outlet.sequence += 1
            for link, place in outlet.readers:
                load = link.load
                if not load:
                    loaded.append(link)
                load.append((place, sample))
            if tap is not None:
                tap(Published(self._scheduler.now, key, outlet.topic, sample))

    def _depart(self) -> None:
        loaded, self._loaded = self._loaded, []
        for link in loaded:
            link.depart()
