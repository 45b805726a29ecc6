"""The network: each directed link between two processes has its own delay, jitter, loss and reordering; and UDP.

The messages of one step to another process travel together and in order, as on a real TCP link. Loss drops single
messages (an event is late instead, because a real link repeats it). Reordering delays single messages so that later
ones overtake them. Each link has its own random generator, seeded with the run's seed and the link's ends, so links do
not affect each other.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from random import Random

from flockwire_core.compiling import mypyc_attr
from flockwire_core.domain.record import Frozen
from flockwire_core.domain.time import SECOND, nanoseconds
from flockwire_core.process.cores import Address, Datagram
from flockwire_core.swarm.tables import Sim
from flockwire_core.wire.cdr import MessageError
from flockwire_core.wire.codec import CODECS, Message
from flockwire_core.wire.inbox import Inbox, Input
from flockwire_core.wire.keys import Delivery, KeyRow

from flockwire_lab.rare import RareBranches
from flockwire_lab.virtual_time import Scheduler


@mypyc_attr(acyclic=True)
class Sample:
    """One message on the wire: the `sequence`-th of `publisher`, sent at `sent` (Unix ns).

    These three are the attachment of a real sample; nothing forges it here, so it is not encoded. The message itself
    arrives as it was sent, which takes 10 % off the virtual time; if `sealed`, it arrives as its bytes say.
    """

    __slots__ = ("_message", "_payload", "_sealed", "publisher", "row", "sent", "sequence")

    def __init__(self, row: KeyRow, message: Message, sequence: int, sent: int, publisher: bytes, sealed: bool) -> None:
        self.row, self.sequence, self.sent, self.publisher = row, sequence, sent, publisher
        self._message: Message | None = message
        self._sealed = sealed
        self._payload = CODECS[row.message].encode(message) if sealed else b""

    @property
    def payload(self) -> bytes:
        """The bytes of the message."""
        if not self._payload:
            self._payload = CODECS[self.row.message].encode(self._message)
        return self._payload

    def message(self) -> Message | None:
        """Return the message; None if it is malformed."""
        if self._sealed:
            self._sealed = False
            try:
                self._message = CODECS[self.row.message].decode(self._payload)
            except MessageError:
                self._message = None
        return self._message


Parcel = tuple[int, Sample]  # a sample, and the index of its subscription


class Slot(Input):
    """The newest sample of a key, buffered at a process until it is read."""

    __slots__ = ("prompt", "sample", "timing")

    def __init__(self, inbox: Inbox, timing: bool, prompt: bool) -> None:
        super().__init__(inbox)
        self.timing, self.prompt = timing, prompt  # whether it is for the timekeeping, and read at once
        self.sample: Sample | None = None

    def message(self, now: int) -> Message | None:
        """Return the message since the last call, None if there is none or it was rejected."""
        sample = self.sample
        if sample is None:
            return None
        self.sample = None
        return self.inbox.admit(sample.message(), sample.sequence, sample.sent, sample.publisher, now)


HELD_BACK = 0.05  # s, largest delay by reordering


@dataclass(frozen=True, slots=True)
class Conditions(Frozen):
    """The conditions of a link: times in s, shares from 0 to 1."""

    delay: float = 0.0
    jitter: float = 0.0
    loss: float = 0.0
    reordering: float = 0.0


@mypyc_attr(allow_interpreted_subclasses=True)
class DirectedLink:
    """One direction of a link, from its `usual` conditions on; of those that disturb it, the last count."""

    def __init__(self, usual: Conditions) -> None:
        self.conditions, self.passable = usual, True  # the present ones, and whether anything passes
        self._usual = usual
        self._disturbances: list[Conditions | None] = []

    def disturb(self, by: Conditions | None) -> None:
        """Apply other conditions, or block all (None), until `restore` has been called as often with them."""
        self._disturbances.append(by)
        self._update()

    def restore(self, after: Conditions | None) -> None:
        """Undo one `disturb`."""
        self._disturbances.remove(after)
        self._update()

    def _update(self) -> None:
        self.passable = None not in self._disturbances
        self.conditions = [self._usual, *(one for one in self._disturbances if one is not None)][-1]


class VirtualLink(DirectedLink):
    """The link from one process to another; calls `deliver` with arriving messages, sometimes `rare`."""

    def __init__(
        self,
        ends: tuple[str, str],
        usual: Conditions,
        seed: int,
        scheduler: Scheduler,
        deliver: Callable[[list[Parcel]], None],
        rare: RareBranches | None = None,
    ) -> None:
        super().__init__(usual)
        self.load: list[Parcel] = []  # the next load to depart
        self._scheduler, self._deliver, self._rare = scheduler, deliver, rare
        self._random = Random(f"{seed} {ends[0]} > {ends[1]}")  # noqa: S311  (not for secrets)
        self._last_arrival = 0
        self._update()

    def depart(self) -> None:
        """Send the load."""
        load, self.load = self.load, []
        if self._steady:
            self._scheduler.at(self._scheduler.now + self._delay, self._deliver, load)
            return
        if not self.passable:
            return
        now, chance, conditions = self._scheduler.now, self._random.random, self.conditions
        travel = self._delay + (round(chance() * conditions.jitter * SECOND) if conditions.jitter else 0)
        if self._rare is not None:
            if any(sample.row.delivery is Delivery.EVENT for _, sample in load) and (closed := self._rare.closed()):
                self.disturb(None)
                self._scheduler.at(now + closed, self.restore, None)
                return
            travel += self._rare.late_message()
        self._last_arrival = max(now + travel, self._last_arrival)
        self._spread(load, self._last_arrival)

    def _update(self) -> None:
        super()._update()
        now = self.conditions
        self._delay = round(now.delay * SECOND)
        # A link keeps its order under changing conditions, so it must know the arrival of its last load.
        self._steady = not (self._disturbances or now.jitter or now.loss or now.reordering)
        self._steady = self._steady and self._rare is None and self._last_arrival <= self._scheduler.now + self._delay

    def _spread(self, load: list[Parcel], arrival: int) -> None:
        """Let a load arrive together, but for what is lost or held back."""
        chance, conditions, together = self._random.random, self.conditions, []
        for parcel in load:
            if conditions.loss and chance() < conditions.loss:
                if parcel[1].row.delivery is Delivery.EVENT:
                    self._scheduler.at(arrival + self._until_it_gets_through(conditions.loss), self._deliver, [parcel])
            elif conditions.reordering and chance() < conditions.reordering:
                self._scheduler.at(arrival + round(chance() * HELD_BACK * SECOND), self._deliver, [parcel])
            else:
                together.append(parcel)
        if together:
            self._scheduler.at(arrival, self._deliver, together)

    def _until_it_gets_through(self, loss: float) -> int:
        again, most = 0.2, 20  # s after which a lost event is sent again, and how often
        tries = 1
        while tries < most and self._random.random() < loss:
            tries += 1
        return round(tries * again * SECOND)


Receive = Callable[[Datagram], None]


class DatagramNetwork:
    """Carries datagrams under the conditions of the swarm file's [sim]; one to an unbound address is lost."""

    def __init__(self, table: Sim, seed: int, scheduler: Scheduler) -> None:
        self._table, self._scheduler = table, scheduler
        self._random = Random(f"{seed} datagrams")  # noqa: S311  (not for secrets)
        self._bound: dict[Address, Receive] = {}

    def bind(self, address: Address, receive: Receive) -> None:
        """Call `receive` with datagrams to `address`."""
        self._bound[address] = receive

    def send(self, datagram: Datagram) -> None:
        """Send; the order may change if the delay varies."""
        table, chance = self._table, self._random.random
        receive = self._bound.get(datagram.target)
        if receive is None or (table.loss and chance() < table.loss):
            return
        delay = table.delay + (table.jitter * chance() if table.jitter else 0.0)
        self._scheduler.at(self._scheduler.now + nanoseconds(delay), receive, datagram)
