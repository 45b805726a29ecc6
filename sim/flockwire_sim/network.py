"""The network: each directed link between two processes has a delay, jitter, loss and reordering of its own; and UDP.

What a process publishes to another in one step travels together and in order, as on the TCP link of a real flight. Loss
takes single messages (an event, which a real link would send again, comes late instead); reordering holds single
messages back so that later ones overtake them. Chance is drawn from a generator for each link, seeded with the run's
seed and the link's ends: what one link draws does not depend on the others.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from random import Random

from flockwire.domain.time import SECOND, nanoseconds
from flockwire.process.cores import Address, Datagram
from flockwire.swarm.tables import Sim
from flockwire.wire.keys import Delivery

from flockwire_sim.sample import Parcel
from flockwire_sim.virtual_time import Scheduler

HELD_BACK = 0.05  # s, at most, that reordering holds a message back
AGAIN = 0.2  # s after which a lost event is sent again
TRIES = 20


@dataclass(frozen=True, slots=True)
class Conditions:
    """What a link does to messages: times in s, shares from 0 to 1."""

    delay: float = 0.0
    jitter: float = 0.0
    loss: float = 0.0
    reordering: float = 0.0

    @classmethod
    def usual(cls, table: Sim) -> Conditions:
        """Return the conditions that the swarm file gives to all links."""
        return cls(table.delay, table.jitter, table.loss, table.reordering)


class VirtualLink:
    """What one process publishes to another, in transit to `deliver`."""

    def __init__(
        self,
        ends: tuple[str, str],
        usual: Conditions,
        seed: int,
        scheduler: Scheduler,
        deliver: Callable[[list[Parcel]], None],
    ) -> None:
        self.load: list[Parcel] = []  # what departs next
        self._scheduler, self._deliver = scheduler, deliver
        self._random = Random(f"{seed} {ends[0]} > {ends[1]}")  # noqa: S311  (not for secrets)
        self._conditions = [usual]  # the last one counts
        self._cuts = 0
        self._last_arrival = 0
        self._update()

    def depart(self) -> None:
        """Send the load."""
        load, self.load = self.load, []
        if self._steady:
            self._scheduler.at(self._scheduler.now + self._delay, self._deliver, load)
        elif not self._cuts:
            self._depart(load)

    def cut(self) -> None:
        """Let nothing through until `mend` has been called as often as this."""
        self._cuts += 1
        self._update()

    def mend(self) -> None:
        """Undo one `cut`."""
        self._cuts -= 1
        self._update()

    def impose(self, conditions: Conditions) -> None:
        """Apply other `conditions` until they are lifted."""
        self._conditions.append(conditions)
        self._update()

    def lift(self, conditions: Conditions) -> None:
        """Undo one `impose`."""
        self._conditions.remove(conditions)
        self._update()

    def _update(self) -> None:
        now = self._conditions[-1]
        self._delay = round(now.delay * SECOND)
        # Under changing conditions a link keeps its order, and must know when its last load arrives.
        self._steady = len(self._conditions) == 1 and not (self._cuts or now.jitter or now.loss or now.reordering)
        self._steady = self._steady and self._last_arrival <= self._scheduler.now + self._delay

    def _depart(self, load: list[Parcel]) -> None:
        now, chance, conditions = self._scheduler.now, self._random.random, self._conditions[-1]
        travel = self._delay + (round(chance() * conditions.jitter * SECOND) if conditions.jitter else 0)
        arrival = self._last_arrival = max(now + travel, self._last_arrival)
        together = []
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
        tries = 1
        while tries < TRIES and self._random.random() < loss:
            tries += 1
        return round(tries * AGAIN * SECOND)


Receive = Callable[[Datagram], None]


class DatagramNetwork:
    """Carries datagrams under the conditions of the swarm file's [sim]; one to an address that nobody has is lost."""

    def __init__(self, table: Sim, seed: int, scheduler: Scheduler) -> None:
        self._table, self._scheduler = table, scheduler
        self._random = Random(f"{seed} datagrams")  # noqa: S311  (not for secrets)
        self._bound: dict[Address, Receive] = {}

    def bind(self, address: Address, receive: Receive) -> None:
        """Let `receive` take what comes to `address`."""
        self._bound[address] = receive

    def send(self, datagram: Datagram) -> None:
        """Send; nothing keeps the order when the delay varies."""
        table, chance = self._table, self._random.random
        receive = self._bound.get(datagram.target)
        if receive is None or (table.loss and chance() < table.loss):
            return
        delay = table.delay + (table.jitter * chance() if table.jitter else 0.0)
        self._scheduler.at(self._scheduler.now + nanoseconds(delay), receive, datagram)
