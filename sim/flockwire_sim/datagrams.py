"""UDP in virtual time: datagrams between processes, with random delay, loss and reordering."""

from __future__ import annotations

from collections.abc import Callable
from random import Random

from flockwire.domain.time import nanoseconds
from flockwire.process.cores import Address, Datagram
from flockwire.swarm.tables import Sim

from flockwire_sim.scheduler import Scheduler

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
