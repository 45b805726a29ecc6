"""What a core is, what it is given at its start, and where the process table's cores come from."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple, Protocol, cast, runtime_checkable

from flockwire.objects import load_object
from flockwire.process.faults import Fault
from flockwire.wire.codec import Message
from flockwire.wire.keys import Key
from flockwire.wire.plan import Plan
from flockwire.wire.status import Report


class Randomness(Protocol):
    """Where chance comes from: a seeded random.Random."""

    def gauss(self, mu: float, sigma: float) -> float:
        """Return a normally distributed number."""

    def random(self) -> float:
        """Return a number evenly distributed over [0, 1)."""


class Start(NamedTuple):
    """What a core is given at its start."""

    plan: Plan
    identity: str
    now: int  # Unix ns
    chance: Randomness
    faults: tuple[Fault, ...] = ()  # of its own kinds (processes.py)
    took_off: int | None = None  # when the flight's faults count from, Unix ns, where that is known already

    @property
    def drone(self) -> int:
        """The drone that the process serves; raises ValueError when it serves none."""
        drone = self.plan.members[self.identity].drone
        if drone is None:
            raise ValueError(f"{self.identity} serves no drone")
        return drone


class Core(Protocol):
    """What a process does, without clock, input and output."""

    @property
    def triggers(self) -> frozenset[Key]:
        """The keys whose arrival may call for a step; empty for a core that steps at a rate of its own."""

    @property
    def prompt(self) -> frozenset[Key]:
        """Further keys that are handed over as soon as they arrive; all others are buffered until the next step."""

    @property
    def period(self) -> float:
        """Seconds between steps (with a trigger: when to step without one)."""

    def receive(self, key: Key, message: Message, now: int) -> None:
        """Take a message in at `now`, Unix time in ns."""

    def due(self, key: Key) -> bool:
        """Return whether the message of the trigger `key` that was just received calls for a step."""

    def step(self, now: int) -> Iterable[tuple[Key, Message]]:
        """Return what to publish at `now`, Unix time in ns."""

    def report(self, now: int) -> Report:
        """Return how it is at `now`."""

    def retire(self, now: int) -> None:
        """Bring down what it flies: the process is to end."""

    def may_end(self, now: int) -> bool:
        """Return whether the process may end: nothing that it flies is in the air."""


Address = tuple[str, int]  # IP, port


class Datagram(NamedTuple):
    """One UDP datagram to send."""

    data: bytes
    source: Address  # one of its own sockets
    target: Address


@runtime_checkable
class Networked(Protocol):
    """A core that exchanges UDP datagrams too."""

    @property
    def sockets(self) -> tuple[Address, ...]:
        """The addresses to bind."""

    def datagram(self, data: bytes, sender: Address, at: Address, now: int) -> None:
        """Receive a datagram that came from `sender` to its socket `at`, at `now` (Unix ns)."""

    def outgoing(self, now: int) -> list[Datagram]:
        """Return what is to be sent at `now`; called after whatever the core takes in, and after each step."""


@runtime_checkable
class Untimed(Protocol):
    """A core that begins before swarm time is known: what it drives cannot wait (`untimed` in the process table)."""

    def correct(self, by: int) -> None:
        """Record that `now` jumps ahead by `by` ns (back if negative): this time has not passed."""


class Ground:
    """What cores have in common that fly nothing: they may end at any time, and step at a rate of their own."""

    def __init__(self) -> None:
        self.triggers: frozenset[Key] = frozenset()
        self.prompt: frozenset[Key] = frozenset()

    def receive(self, key: Key, message: Message, now: int) -> None:
        """Take nothing in."""

    def due(self, key: Key) -> bool:
        """Return False: no message calls for a step."""
        return False

    def step(self, now: int) -> Iterable[tuple[Key, Message]]:
        """Publish nothing."""
        return ()

    def retire(self, now: int) -> None:
        """Do nothing."""

    def may_end(self, now: int) -> bool:
        """Return True."""
        return True


def make_core(start: Start) -> Core:
    """Return the core that the process table names for `start`."""
    return cast("Core", load_object(start.plan.rows[start.identity].core)(start))
